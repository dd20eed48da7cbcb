#include "estimator/discovery/dictionary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <map>
#include <string_view>
#include <utility>

namespace selfcal::discovery {
namespace {

constexpr double seconds_per_hour = 3600.0;
// Of the probability of a factor, what the quantities themselves have; the rest have their sizes, squares, harmonics.
constexpr double plain_share = 0.65;

class Builder {
 public:
  Builder(const PieceSums& sums, const laws::VariableSet& available) : sums_(sums), available_(available) {
    double duration_s = 0.0;
    for (const Node& node : sums.nodes) {
      duration_s = std::max(duration_s, node.time_s + 0.5 * node.dt);
    }
    duration_h_ = duration_s / seconds_per_hour;
    node_dt_.resize(static_cast<Eigen::Index>(sums.nodes.size()));
    for (std::size_t k = 0; k < sums.nodes.size(); ++k) {
      node_dt_(static_cast<Eigen::Index>(k)) = sums.nodes[k].dt;
      if (runs_.empty() || sums.piece_of[k] != runs_.back().piece) {
        runs_.push_back({sums.piece_of[k], static_cast<Eigen::Index>(k), 0});
      }
      ++runs_.back().count;
    }
  }

  Dictionary run() {
    geometry();
    kernels();
    enumerate();
    finish();
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
  // A factor and the probability with which it is drawn where a function has one.
  struct Choice {
    int factor = 0;
    double belief = 0.0;
    bool alone = true;  // false: less a constant it is another one
  };

  void add_all(std::vector<Choice>& choices, std::initializer_list<const char*> texts, double belief,
               bool alone = true) {
    for (const char* text : texts) {
      const int factor = add(text);
      if (factor >= 0) {
        choices.push_back({factor, belief, alone});
      }
    }
  }

  // What a sensor may depend on. The probabilities add up to 1 where all channels are there.
  void geometry() {
    constexpr double plain = plain_share / 16.0, formed = (1.0 - plain_share) / 39.0;
    add_all(main_,
            {"fx", "fy", "fz", "wx", "wy", "wz", "wo", "wi", "sin(outer)", "cos(outer)", "sin(inner)", "cos(inner)",
             "so", "si", "t", "T"},
            plain);
    all_ = main_;
    add_all(all_,
            {"abs(fx)", "abs(fy)", "abs(fz)", "abs(wx)", "abs(wy)", "abs(wz)", "abs(wo)", "abs(wi)", "abs(so)",
             "abs(si)", "abs(sin(outer))", "abs(cos(outer))", "abs(sin(inner))", "abs(cos(inner))"},
            formed);
    add_all(all_, {"fx**2", "fy**2", "fz**2", "wx**2", "wy**2", "wz**2", "wo**2", "wi**2", "t**2", "T**2"}, formed);
    add_all(all_,
            {"sin(2*outer)", "cos(2*outer)", "sin(2*inner)", "cos(2*inner)", "sin(3*outer)", "cos(3*outer)",
             "sin(3*inner)", "cos(3*inner)", "n", "dT"},
            formed);
    add_all(all_, {"sin(outer)**2", "cos(outer)**2", "sin(inner)**2", "cos(inner)**2", "T*dT"}, formed, false);
  }

  void add_grid(std::vector<Choice>& choices, const char* text, Kernel kernel, std::initializer_list<double> constants,
                double belief, double unit = 1.0) {
    for (const double constant : constants) {
      const int factor = add(text, kernel, unit * constant);
      if (factor >= 0) {
        choices.push_back({factor, belief / static_cast<double>(constants.size())});
      }
    }
  }

  void kernels() {
    // What begins anew with a turn, and holds its size until the turn is over, counts by `rest`. Nothing creeps before the first turn.
    add_grid(decays_, "exp(-since/?)", Kernel::creep, {4.0, 7.0, 11.0, 17.0, 26.0, 40.0, 60.0, 90.0, 140.0, 220.0},
             0.4);
    add_grid(decays_, "exp(-rest/?)", Kernel::creep, {4.0, 11.0, 26.0, 60.0, 140.0}, 0.1);
    // Relaxation with many time constants (Kohlrausch 1854), fast at first and with a long tail.
    add_grid(decays_, "exp(-sqrt(since/?))", Kernel::creep, {2.0, 6.0, 18.0, 54.0}, 0.05);
    add_grid(decays_, "log(1+rest/?)*sign(n)", Kernel::log_creep, {1.0, 4.0, 15.0, 60.0}, 0.1);
    add_grid(decays_, "log(1+since/?)*sign(n)", Kernel::log_creep, {1.0, 4.0, 15.0, 60.0}, 0.1);
    add_grid(decays_, "exp(-t/?)", Kernel::warm_up, {0.05, 0.1, 0.18, 0.3, 0.5, 0.9}, 0.25, duration_h_);
    // Beside two quantities the constants stand 2.5 apart: a decay between two of them is like one of them to 0.95.
    add_grid(coarse_decays_, "exp(-since/?)", Kernel::creep, {4.0, 11.0, 26.0, 60.0, 140.0}, 0.45);
    add_grid(coarse_decays_, "exp(-rest/?)", Kernel::creep, {8.0, 45.0}, 0.1);
    add_grid(coarse_decays_, "log(1+rest/?)*sign(n)", Kernel::log_creep, {2.0, 20.0}, 0.1);
    add_grid(coarse_decays_, "log(1+since/?)*sign(n)", Kernel::log_creep, {2.0, 20.0}, 0.1);
    add_grid(coarse_decays_, "exp(-t/?)", Kernel::warm_up, {0.06, 0.18, 0.5}, 0.25, duration_h_);
    waves();
    quotients();
    for (std::size_t k = 1; k < sums_.pieces.size(); ++k) {
      const Piece& piece = sums_.pieces[k];
      if (!piece.turning) {
        const int factor = add("sign(t-?)", Kernel::step, piece.start_s / seconds_per_hour);
        if (factor >= 0) {
          steps_.push_back({factor, 1.0 / static_cast<double>(sums_.pieces.size())});
        }
      }
    }
  }

  // The shortest wave over the time is twice the longest piece. Over the count of turns it is whatever lies between the turns, so that
  // dwells of other lengths tell it from one over the time; what takes less than two turns is another wave at the turns.
  void waves() {
    constexpr double shortest_h = 120.0 / seconds_per_hour, shortest_turns = 2.0;
    const double turns = sums_.channels.col(static_cast<Eigen::Index>(laws::Variable::n)).maxCoeff() + 1.0;
    add_waves(waves_, "(2*pi*t/?)", Kernel::wave, duration_h_, shortest_h);
    add_waves(turn_waves_, "(2*pi*n/?)", Kernel::turn_wave, turns, shortest_turns);
  }

  // Half a period of resolution apart over the `whole`. A period is as probable as any other on a logarithmic scale: of two that one plan
  // cannot tell apart the longer one wins.
  void add_waves(std::vector<Choice>& choices, const std::string& phase, Kernel kernel, double whole, double shortest) {
    for (int k = 1; 2.0 * whole / k > shortest; ++k) {
      const double period = 2.0 * whole / k;
      const int sine = add("sin" + phase, kernel, period);
      const int cosine = add("cos" + phase, kernel, period);
      if (sine >= 0 && cosine >= 0) {
        choices.push_back({sine, 1.0 / k});
        cosine_[sine] = cosine;
      }
    }
    make_certain(choices);
  }

  // A response that grows or falls by a share of what it is: a stiffness, a gap. The constant is what the sum of both falls short of at
  // the most, so that none of its values gives a pole.
  void quotients() {
    constexpr std::array texts = {
        "1/(1+?+fx)",         "1/(1+?+fy)",         "1/(1+?+fz)",         "1/(1+?+sin(outer))", "1/(1+?+cos(outer))",
        "1/(1+?+sin(inner))", "1/(1+?+cos(inner))", "1/(1+?-fx)",         "1/(1+?-fy)",         "1/(1+?-fz)",
        "1/(1+?-sin(outer))", "1/(1+?-cos(outer))", "1/(1+?-sin(inner))", "1/(1+?-cos(inner))"};
    for (const char* text : texts) {
      add_grid(quotients_, text, Kernel::quotient, {0.1, 0.25, 0.6, 1.5}, 1.0 / static_cast<double>(texts.size()));
    }
  }

  // Those of at most five periods in the recording: beside two quantities others are too many.
  std::vector<Choice> slow_waves() const {
    constexpr std::size_t most = 10;
    std::vector<Choice> slow(waves_.begin(),
                             waves_.begin() + static_cast<std::ptrdiff_t>(std::min(most, waves_.size())));
    make_certain(slow);
    return slow;
  }
  static void make_certain(std::vector<Choice>& choices) {
    double sum = 0.0;
    for (const Choice& choice : choices) {
      sum += choice.belief;
    }
    for (Choice& choice : choices) {
      choice.belief /= sum;
    }
  }

  struct Draw {
    std::vector<int> factors;
    double belief = 1.0;
  };

  bool is_plain(int factor) const { return factor <= main_.back().factor; }  // they are the first
  // Draws in which one quantity at least is a plain one; a size, a square or a harmonic.
  std::vector<Draw> with_plain(std::vector<Draw> draws) const {
    std::erase_if(draws, [&](const Draw& draw) {
      return std::ranges::none_of(draw.factors, [&](int factor) { return is_plain(factor); });
    });
    return draws;
  }
  // T and its rate together are a quantity of their own.
  std::vector<Draw> with_formed(std::vector<Draw> draws) const {
    const auto has = [&](const Draw& draw, const char* text) {
      return std::ranges::any_of(
          draw.factors, [&](int factor) { return dictionary_.factors[static_cast<std::size_t>(factor)].text == text; });
    };
    std::erase_if(draws, [&](const Draw& draw) {
      return std::ranges::all_of(draw.factors, [&](int factor) { return is_plain(factor); }) ||
             (has(draw, "T") && has(draw, "dT"));
    });
    return draws;
  }

  // All unordered draws of `depth` different choices. `alone`: nothing is multiplied to them.
  static std::vector<Draw> products(const std::vector<Choice>& choices, int depth, bool alone = false) {
    std::vector<Draw> draws(1);
    std::vector<std::size_t> next(1, 0);
    for (int level = 1; level <= depth; ++level) {
      std::vector<Draw> longer;
      std::vector<std::size_t> after;
      for (std::size_t d = 0; d < draws.size(); ++d) {
        for (std::size_t k = next[d]; k < choices.size(); ++k) {
          if (alone && !choices[k].alone) {
            continue;
          }
          longer.push_back(draws[d]);
          longer.back().factors.push_back(choices[k].factor);
          longer.back().belief *= choices[k].belief * level;  // as many orders as places for the new one
          after.push_back(k + 1);
        }
      }
      draws = std::move(longer);
      next = std::move(after);
    }
    return draws;
  }

  // The kernel first, for the dictionary takes a function's kernel and constant from its first factor.
  static std::vector<Draw> times(const std::vector<Choice>& kernels, const std::vector<Draw>& with) {
    std::vector<Draw> draws;
    draws.reserve(kernels.size() * with.size());
    for (const Choice& kernel : kernels) {
      for (const Draw& other : with) {
        draws.push_back({{kernel.factor}, kernel.belief * other.belief});
        draws.back().factors.insert(draws.back().factors.end(), other.factors.begin(), other.factors.end());
      }
    }
    return draws;
  }

  // Shares of belief before any data: what sensors do is mostly one or two quantities, or a creep or warm-up of one. Of three factors those
  // of plain quantities are the more probable ones.
  void enumerate() {
    constexpr double plain_two = plain_share * plain_share, plain_three = plain_two * plain_share;
    constexpr double formed_two = 1.0 - plain_two, formed_three = 1.0 - plain_three;
    const std::vector<Draw> nothing(1), one = products(all_, 1), two = products(all_, 2), main_one = products(main_, 1),
                                        main_two = products(main_, 2), other_two = with_formed(two);
    collect(products(all_, 1, true), 0.185);
    collect(two, 0.27);
    collect(products(main_, 3), 0.037 / plain_three);
    collect(with_formed(products(all_, 3)), 0.03 / formed_three);
    collect(times(decays_, nothing), 0.11);
    collect(times(decays_, one), 0.14);
    collect(times(decays_, main_two), 0.028 / plain_two);
    collect(times(coarse_decays_, other_two), 0.015 / formed_two);
    collect(times(waves_, nothing), 0.063);
    collect(times(waves_, one), 0.046);
    collect(times(slow_waves(), main_two), 0.006 / plain_two);
    collect(times(slow_waves(), with_plain(other_two)), 0.004 / formed_two);
    // Equal dwells do not tell them from waves over the time: where a sensor goes by the time ten times as often as by the count, that decides.
    collect(times(turn_waves_, nothing), 0.004);
    collect(times(turn_waves_, main_one), 0.004 / plain_share);
    collect(times(quotients_, nothing), 0.009);
    collect(times(quotients_, main_one), 0.019 / plain_share);
    collect(times(steps_, nothing), 0.03);
  }

  // Of a product over the pieces. All but its last factor are those of the product before, more often than not.
  Eigen::VectorXd means_of(const std::vector<int>& factors) {
    const std::vector<int> leading(factors.begin(), factors.end() - 1);
    if (leading != leading_ || leading_product_.size() == 0) {
      leading_ = leading;
      leading_product_ = node_dt_;
      for (const int factor : leading) {
        leading_product_ *= values_[static_cast<std::size_t>(factor)];
      }
    }
    const Eigen::ArrayXd& last = values_[static_cast<std::size_t>(factors.back())];
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(sums_.piece_dt.size());
    for (const Run& run : runs_) {
      mean(run.piece) +=
          leading_product_.segment(run.first, run.count).matrix().dot(last.segment(run.first, run.count).matrix());
    }
    return (sums_.piece_dt.array() > 0.0).select(mean.array() / sums_.piece_dt.array().max(1e-12), 0.0);
  }

  int add_function(const std::vector<int>& factors, double cost) {
    const Eigen::VectorXd mean = means_of(factors);
    const double total = sums_.piece_dt.sum();
    const double average = mean.dot(sums_.piece_dt) / total;
    const double square = (mean.array().square() * sums_.piece_dt.array()).sum() / total;
    if (!(square > 0.0) || square - average * average < 1e-9 * square) {
      return -1;  // zero, or a constant: that is the bias
    }
    const double rms = std::sqrt(square);
    const auto column = static_cast<Eigen::Index>(scales_.size());
    if (column == dictionary_.means.cols()) {
      dictionary_.means.conservativeResize(mean.size(), std::max<Eigen::Index>(1024, 2 * column));
    }
    dictionary_.means.col(column) = (mean / rms).cast<float>();
    scales_.push_back(rms);
    Function function{factors, Kernel::none, 0.0, -1, false, cost};
    const Factor& first = dictionary_.factors[static_cast<std::size_t>(factors.front())];
    function.kernel = first.kernel;
    function.constant = first.constant;
    dictionary_.functions.push_back(std::move(function));
    return static_cast<int>(dictionary_.functions.size()) - 1;
  }

  void collect(const std::vector<Draw>& draws, double belief) {
    for (const Draw& draw : draws) {
      const double cost = std::log(axis_count / (belief * draw.belief));
      const int index = add_function(draw.factors, cost);
      const auto cosine = cosine_.find(draw.factors.front());
      if (index >= 0 && cosine != cosine_.end()) {
        std::vector<int> partner = draw.factors;
        partner.front() = cosine->second;
        const int other = add_function(partner, cost);  // dictionary_.functions may move
        dictionary_.functions[static_cast<std::size_t>(index)].partner = other;
        if (other >= 0) {
          dictionary_.functions[static_cast<std::size_t>(other)].second = true;
        }
      }
    }
  }

  void finish() {
    const auto count = static_cast<Eigen::Index>(scales_.size());
    dictionary_.means.conservativeResize(sums_.piece_dt.size(), count);
    dictionary_.scale = Eigen::Map<const Eigen::VectorXd>(scales_.data(), count);
  }

  const PieceSums& sums_;
  laws::VariableSet available_;
  double duration_h_ = 0.0;
  // Nodes one behind the other that lie in one piece.
  struct Run {
    Eigen::Index piece = 0, first = 0, count = 0;
  };
  std::vector<Run> runs_;
  Eigen::ArrayXd node_dt_;
  std::vector<int> leading_;
  Eigen::ArrayXd leading_product_;  // of these, times dt
  Dictionary dictionary_;
  std::vector<Eigen::ArrayXd> values_;  // [factors]
  std::vector<double> scales_;
  std::vector<Choice> main_, all_, decays_, coarse_decays_, steps_, waves_, turn_waves_, quotients_;
  std::map<int, int> cosine_;  // of a wave's sine
};

}  // namespace

std::string Dictionary::pattern(const Function& function) const {
  constexpr std::string_view squared = "**2";
  std::vector<std::pair<std::string, int>> powers;  // of each quantity, in order
  for (const int factor : function.factors) {
    std::string base = factors[static_cast<std::size_t>(factor)].text;
    const bool square = base.ends_with(squared);
    base.resize(base.size() - (square ? squared.size() : 0));
    const auto same = std::find_if(powers.begin(), powers.end(), [&](const auto& p) { return p.first == base; });
    if (same == powers.end()) {
      powers.emplace_back(base, square ? 2 : 1);
    } else {
      same->second += square ? 2 : 1;
    }
  }
  std::string text;
  for (const auto& [base, power] : powers) {
    text += (text.empty() ? "" : "*") + base + (power > 1 ? "**" + std::to_string(power) : "");
  }
  return text;
}

Dictionary make_dictionary(const PieceSums& sums, const laws::VariableSet& available) {
  return Builder(sums, available).run();
}

}  // namespace selfcal::discovery
