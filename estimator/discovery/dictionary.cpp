#include "estimator/discovery/dictionary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selfcal::discovery {
namespace {

constexpr double seconds_per_hour = 3600.0;

class Builder {
 public:
  Builder(const PieceSums& sums, const laws::VariableSet& available) : sums_(sums), available_(available) {
    double duration_s = 0.0;
    for (const Node& node : sums.nodes) {
      duration_s = std::max(duration_s, node.time_s + 0.5 * node.dt);
    }
    duration_h_ = duration_s / seconds_per_hour;
  }

  Dictionary run() {
    geometry();
    kernels();
    enumerate();
    collect();
    return std::move(dictionary_);
  }

 private:
  // Adds a factor if the recording has its variables; returns its index or -1.
  int add(const std::string& text, Kernel kernel = Kernel::none, double constant = 0.0) {
    const auto expression = laws::Expression::parse(text);
    if (!expression || (expression->variables() & ~available_).any()) {
      return -1;
    }
    const std::vector<double> constants(expression->free_constants(), constant);
    Eigen::ArrayXd values = expression->evaluate(sums_.channels, constants);
    if (!values.isFinite().all() || values.abs().maxCoeff() < 1e-12) {
      return -1;
    }
    values_.push_back(std::move(values));
    dictionary_.factors.push_back({text, kernel, constant});
    return static_cast<int>(values_.size()) - 1;
  }
  void add_to(std::vector<int>& family, const std::string& text, Kernel kernel = Kernel::none, double constant = 0.0) {
    const int index = add(text, kernel, constant);
    if (index >= 0) {
      family.push_back(index);
    }
  }

  void geometry() {
    for (const char* text : {"fx", "fy", "fz", "wx", "wy", "wz", "sin(outer)", "cos(outer)", "sin(inner)", "cos(inner)",
                             "so", "si", "t", "T"}) {
      add_to(main_, text);
    }
    for (const char* text :
         {"abs(fx)", "abs(fy)", "abs(fz)", "abs(wx)", "abs(wy)", "abs(wz)", "wo", "wi", "abs(wo)", "abs(wi)",
          "sin(2*outer)", "cos(2*outer)", "sin(2*inner)", "cos(2*inner)", "n", "dT", "abs(so)", "abs(si)"}) {
      add_to(further_, text);
    }
  }

  void kernels() {
    for (const double tau : {4.0, 7.0, 11.0, 17.0, 26.0, 40.0, 60.0, 90.0, 140.0, 220.0}) {
      add_to(decays_, "exp(-since/?)", Kernel::creep, tau);
    }
    for (const double tau : {1.0, 4.0, 15.0, 60.0}) {
      // Nothing creeps before the first turn, where `rest` is 1e9.
      add_to(decays_, "log(1+rest/?)*sign(n)", Kernel::log_creep, tau);
      add_to(decays_, "log(1+since/?)*sign(n)", Kernel::log_creep, tau);
    }
    for (const double share : {0.05, 0.1, 0.18, 0.3, 0.5, 0.9}) {
      add_to(decays_, "exp(-t/?)", Kernel::warm_up, share * duration_h_);
    }
    // Half a period of frequency resolution apart; the shortest wave is twice the longest piece.
    constexpr double shortest_h = 120.0 / seconds_per_hour;
    for (int k = 1; 2.0 * duration_h_ / k > shortest_h; ++k) {
      const double period = 2.0 * duration_h_ / k;
      const int sine = add("sin(2*pi*t/?)", Kernel::wave, period);
      const int cosine = add("cos(2*pi*t/?)", Kernel::wave, period);
      if (sine >= 0 && cosine >= 0) {
        waves_.emplace_back(sine, cosine);
      }
    }
    for (std::size_t k = 1; k < sums_.pieces.size(); ++k) {
      const Piece& piece = sums_.pieces[k];
      if (!piece.turning) {
        add_to(steps_, "sign(t-?)", Kernel::step, piece.start_s / seconds_per_hour);
      }
    }
  }

  // Functions of one kind share the cost: pairs of indices here, resolved in collect().
  struct Kind {
    std::vector<std::vector<int>> members;
    std::vector<std::vector<int>> partners;  // of waves, same length
  };

  void products(const std::vector<int>& all, int depth, std::vector<int>& chosen, std::size_t from, Kind& kind) const {
    if (static_cast<int>(chosen.size()) == depth) {
      kind.members.push_back(chosen);
      return;
    }
    for (std::size_t k = from; k < all.size(); ++k) {
      chosen.push_back(all[k]);
      products(all, depth, chosen, k, kind);
      chosen.pop_back();
    }
  }
  Kind products(const std::vector<int>& all, int depth) const {
    Kind kind;
    std::vector<int> chosen;
    products(all, depth, chosen, 0, kind);
    return kind;
  }
  static Kind times(const std::vector<int>& kernels, const Kind& with) {
    Kind kind;
    for (const int kernel : kernels) {
      for (const std::vector<int>& factors : with.members) {
        kind.members.push_back(factors);
        kind.members.back().insert(kind.members.back().begin(), kernel);
      }
    }
    return kind;
  }
  Kind waves_times(const Kind& with) const {
    Kind kind;
    for (const auto& [sine, cosine] : waves_) {
      for (const std::vector<int>& factors : with.members) {
        for (auto [list, wave] : {std::pair(&kind.members, sine), std::pair(&kind.partners, cosine)}) {
          list->push_back(factors);
          list->back().insert(list->back().begin(), wave);
        }
      }
    }
    return kind;
  }

  void enumerate() {
    std::vector<int> all = main_;
    all.insert(all.end(), further_.begin(), further_.end());
    const Kind one = products(all, 1), main_one = products(main_, 1), main_two = products(main_, 2);
    Kind nothing, further_two;
    nothing.members.push_back({});
    for (const std::vector<int>& pair : products(all, 2).members) {
      if (std::find(main_two.members.begin(), main_two.members.end(), pair) == main_two.members.end()) {
        further_two.members.push_back(pair);
      }
    }
    // Shares of belief before any data: what sensors do is mostly one or two quantities, or a creep or warm-up of one.
    kinds_.emplace_back(one, 0.2);
    kinds_.emplace_back(main_two, 0.2);
    kinds_.emplace_back(further_two, 0.08);
    kinds_.emplace_back(times(decays_, nothing), 0.15);
    kinds_.emplace_back(times(decays_, one), 0.15);
    kinds_.emplace_back(waves_times(nothing), 0.08);
    kinds_.emplace_back(times(steps_, nothing), 0.04);
    kinds_.emplace_back(waves_times(main_one), 0.04);
    kinds_.emplace_back(products(main_, 3), 0.03);
    kinds_.emplace_back(times(decays_, main_two), 0.03);
  }

  void collect() {
    std::vector<Eigen::VectorXd> means;
    const double total = sums_.piece_dt.sum();
    const auto add_function = [&](const std::vector<int>& factors, double cost) {
      Eigen::ArrayXd product = values_[static_cast<std::size_t>(factors.front())];
      for (std::size_t k = 1; k < factors.size(); ++k) {
        product *= values_[static_cast<std::size_t>(factors[k])];
      }
      Eigen::VectorXd mean = sums_.means(product);
      const double average = mean.dot(sums_.piece_dt) / total;
      const double square = (mean.array().square() * sums_.piece_dt.array()).sum() / total;
      if (!(square > 0.0) || square - average * average < 1e-9 * square) {
        return -1;  // zero, or a constant: that is the bias
      }
      const double rms = std::sqrt(square);
      means.push_back(mean / rms);
      scales_.push_back(rms);
      Function function{factors, Kernel::none, 0.0, -1, cost};
      const Factor& first = dictionary_.factors[static_cast<std::size_t>(factors.front())];
      function.kernel = first.kernel;
      function.constant = first.constant;
      dictionary_.functions.push_back(std::move(function));
      return static_cast<int>(dictionary_.functions.size()) - 1;
    };
    for (const auto& [kind, belief] : kinds_) {
      const auto count = static_cast<double>(std::max<std::size_t>(1, kind.members.size()) * axis_count);
      const double cost = std::log(count / belief);
      for (std::size_t k = 0; k < kind.members.size(); ++k) {
        const int index = add_function(kind.members[k], cost);
        if (index >= 0 && !kind.partners.empty()) {
          dictionary_.functions[static_cast<std::size_t>(index)].partner = add_function(kind.partners[k], cost);
        }
      }
    }
    dictionary_.means.resize(sums_.piece_dt.size(), static_cast<Eigen::Index>(means.size()));
    dictionary_.scale = Eigen::Map<const Eigen::VectorXd>(scales_.data(), static_cast<Eigen::Index>(scales_.size()));
    for (std::size_t k = 0; k < means.size(); ++k) {
      dictionary_.means.col(static_cast<Eigen::Index>(k)) = means[k];
    }
  }

  const PieceSums& sums_;
  laws::VariableSet available_;
  double duration_h_ = 0.0;
  Dictionary dictionary_;
  std::vector<Eigen::ArrayXd> values_;  // [factors]
  std::vector<double> scales_;
  std::vector<int> main_, further_, decays_, steps_;
  std::vector<std::pair<int, int>> waves_;
  std::vector<std::pair<Kind, double>> kinds_;
};

}  // namespace

std::string Dictionary::pattern(const Function& function) const {
  std::string text;
  for (std::size_t k = 0; k < function.factors.size();) {
    std::size_t last = k;
    while (last < function.factors.size() && function.factors[last] == function.factors[k]) {
      ++last;
    }
    text += (text.empty() ? "" : "*") + factors[static_cast<std::size_t>(function.factors[k])].text;
    if (last - k > 1) {
      text += "**" + std::to_string(last - k);
    }
    k = last;
  }
  return text;
}

Dictionary make_dictionary(const PieceSums& sums, const laws::VariableSet& available) {
  return Builder(sums, available).run();
}

}  // namespace selfcal::discovery
