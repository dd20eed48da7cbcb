#include "estimator/discovery/shortlist.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {
namespace {

// A wave as the dictionary has it, and with its phase.
struct WaveForm {
  std::string_view bare, with_phase, unit;
};
constexpr WaveForm over_time = {"sin(2*pi*t/?)", "sin(2*pi*t/?+?)", "h"};
constexpr WaveForm over_turns = {"sin(2*pi*n/?)", "sin(2*pi*n/?+?)", "turns"};
const WaveForm& form_of(Kernel kernel) { return kernel == Kernel::turn_wave ? over_turns : over_time; }
bool is_wave(Kernel kernel) { return kernel == Kernel::wave || kernel == Kernel::turn_wave; }

// Golden section between two neighbours of the grid: `rounds` shrink the interval to 0.618^rounds of itself.
template <typename F>
double highest_between(double low, double high, int rounds, F&& value) {
  constexpr double golden = 0.6180339887498949;
  double a = low, b = high;
  double x = b - golden * (b - a), y = a + golden * (b - a);
  double vx = value(x), vy = value(y);
  for (int k = 0; k < rounds; ++k) {
    if (vx > vy) {
      b = std::exchange(y, x);
      vy = vx;
      x = b - golden * (b - a);
      vx = value(x);
    } else {
      a = std::exchange(x, y);
      vx = vy;
      y = a + golden * (b - a);
      vy = value(y);
    }
  }
  return vx > vy ? x : y;
}

}  // namespace

std::vector<std::vector<Candidate>> exact_alternatives(std::span<const LawRecording> recordings,
                                                       const std::vector<LawTerm>& given,
                                                       const std::vector<Candidate>& candidates,
                                                       const std::stop_token& stop) {
  static constexpr std::array<double, 7> factors = {0.35, 0.6, 0.85, 1.0, 1.18, 1.7, 2.9};
  std::vector<std::vector<Candidate>> all;
  std::vector<LawTerm> terms;
  for (const Candidate& candidate : candidates) {
    all.emplace_back();
    const bool varied = candidate.term.constants.size() == 1 && !candidate.step;
    for (const double factor : factors) {
      if (varied || factor == 1.0) {
        all.back().push_back(candidate);
        if (varied) {
          all.back().back().term.constants.front() *= factor;
        }
        terms.push_back(all.back().back().term);
      }
    }
  }
  const std::vector<SingleFit> fits = fit_each(recordings, given, terms, stop);
  auto fit = fits.begin();
  for (std::vector<Candidate>& alternatives : all) {
    for (Candidate& c : alternatives) {
      c.gain = fit->gain;
      c.coefficient = fit->coefficient;
      ++fit;
    }
  }
  return all;
}

std::vector<Candidate> best_of(const std::vector<std::vector<Candidate>>& alternatives) {
  std::vector<Candidate> best;
  best.reserve(alternatives.size());
  for (const std::vector<Candidate>& some : alternatives) {
    best.push_back(*std::max_element(some.begin(), some.end(),
                                     [](const Candidate& a, const Candidate& b) { return a.gain < b.gain; }));
  }
  std::sort(best.begin(), best.end(), [](const Candidate& a, const Candidate& b) { return a.merit() > b.merit(); });
  return best;
}

Shortlist::Shortlist(const PieceSums& sums, const Dictionary& dictionary)
    : sums_(sums), dictionary_(dictionary), known_(known_columns(sums)) {}

double Shortlist::gain_of(const PieceModel& model, const LawTerm& term) const {
  const Eigen::ArrayXd values = term.expression.evaluate(sums_.channels, term.constants);
  if (!values.isFinite().all()) {
    return 0.0;
  }
  return model.gain(term.axis, sums_.means(values));
}

double Shortlist::longest_of(Kernel kernel) const {
  double longest = 0.0;
  for (const Factor& factor : dictionary_.factors) {
    longest = factor.kernel == kernel ? std::max(longest, factor.constant) : longest;
  }
  return longest;
}

Eigen::MatrixXd Shortlist::waves(const std::string& sine, const std::string& cosine, double period) const {
  Eigen::MatrixXd X(sums_.piece_dt.size(), 2);
  int column = 0;
  for (const std::string& text : {sine, cosine}) {
    X.col(column++) = sums_.means(laws::Expression::parse(text)->evaluate(sums_.channels, std::vector<double>{period}));
  }
  return X;
}

std::vector<Candidate> Shortlist::values_of_wave(const PieceModel& model, const Candidate& own) const {
  constexpr int steps = 20;  // to either side
  std::vector<Candidate> values;
  for (const auto& [kernel, form] : {std::pair{Kernel::wave, over_time}, std::pair{Kernel::turn_wave, over_turns}}) {
    std::string sine = own.term.expression.text();
    const std::size_t at = sine.find(form.with_phase);
    if (own.term.constants.size() != 2 || at == std::string::npos) {
      continue;
    }
    sine.replace(at, form.with_phase.size(), form.bare);
    std::string cosine = sine;
    cosine.replace(at, 3, "cos");
    const double frequency = 1.0 / own.term.constants[0], apart = wave_step / longest_of(kernel);
    const double here = model.gain(own.term.axis, waves(sine, cosine, own.term.constants[0]));
    for (int k = -steps; k <= steps; ++k) {
      const double period = 1.0 / (frequency + k * apart);
      if (k != 0 && period > own.term.least && period < own.term.most) {
        const Eigen::MatrixXd X = waves(sine, cosine, period);
        const auto [G, b] = model.project(own.term.axis, X);
        const Eigen::Vector2d size = G.ldlt().solve(b);
        Candidate value = own;
        value.term.constants = {period, std::atan2(size(1), size(0))};
        value.coefficient = size.norm();
        value.gain += model.gain(own.term.axis, X) - here;
        values.push_back(std::move(value));
      }
    }
  }
  return values;
}

// Up to its neighbours, which are evenly apart in frequency: no period is left out, and beyond them lie other peaks. Beyond the longest
// a wave is a parabola.
std::pair<double, double> Shortlist::periods_about(const Function& wave) const {
  constexpr double beyond_longest = 1.18;
  const double part = wave.constant / longest_of(wave.kernel);  // of its frequency, to a neighbour
  return {wave.constant / (1.0 + part), wave.constant * (part < 1.0 ? 1.0 / (1.0 - part) : beyond_longest)};
}

Candidate Shortlist::candidate(const PieceModel& model, const Ranked& ranked) const {
  const Function& function = dictionary_.functions[static_cast<std::size_t>(ranked.function)];
  std::string pattern = dictionary_.pattern(function);
  Candidate c;
  c.cost = function.cost;
  c.term.axis = ranked.axis;
  c.gain = ranked.gain;
  if (function.partner >= 0) {
    const Function& partner = dictionary_.functions[static_cast<std::size_t>(function.partner)];
    const std::string cosine = dictionary_.pattern(partner);
    const auto [shortest, longest] = periods_about(function);
    const double period = highest_between(shortest, longest, 12,
                                          [&](double p) { return model.gain(ranked.axis, waves(pattern, cosine, p)); });
    const Eigen::MatrixXd X = waves(pattern, cosine, period);
    const auto [G, b] = model.project(ranked.axis, X);
    const Eigen::VectorXd size = G.ldlt().solve(b);
    c.gain = std::max(c.gain, model.gain(ranked.axis, X));
    c.cost += cost_of_phase(c.gain);
    const WaveForm& form = form_of(function.kernel);
    pattern.replace(pattern.find(form.bare), form.bare.size(), form.with_phase);
    c.term.expression = *laws::Expression::parse(pattern);
    c.term.constants = {period, std::atan2(size(1), size(0))};
    limit(c.term, function.kernel);
    return c;
  }
  c.term.expression = *laws::Expression::parse(pattern);
  if (function.kernel == Kernel::none) {
    return c;
  }
  c.term.constants = {function.constant};
  c.step = function.kernel == Kernel::step;
  if (function.kernel != Kernel::step) {
    const double constant = highest_between(function.constant / 1.7, function.constant * 1.7, 12, [&](double x) {
      LawTerm term = c.term;
      term.constants = {x};
      return gain_of(model, term);
    });
    c.term.constants = {constant};
    limit(c.term, function.kernel);
    c.spacing = spacing_of(function.kernel);
  }
  c.gain = std::max(c.gain, gain_of(model, c.term));
  return c;
}

std::vector<Candidate> Shortlist::best(const PieceModel& model, std::size_t most) const {
  std::vector<Candidate> all = best_over_pieces(model, most);
  if (known_.cols() == 0) {
    return all;
  }
  if (!beside_known_ || beside_known_->of != model.information()) {
    beside_known_.emplace(model.information(), known_, dictionary_);
  }
  const auto of_all = static_cast<std::ptrdiff_t>(all.size());
  for (Candidate& other : best_over_pieces(model.beside(*beside_known_), (most + 2) / 3)) {
    const auto same = std::find_if(all.begin(), all.begin() + of_all,
                                   [&](const Candidate& c) { return same_law(c.term, other.term); });
    if (same == all.begin() + of_all) {
      all.push_back(std::move(other));
    } else {
      same->gain = std::max(same->gain, other.gain);
    }
  }
  std::sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) { return a.merit() > b.merit(); });
  return all;
}

std::vector<Candidate> Shortlist::best_over_pieces(const PieceModel& model, std::size_t most) const {
  constexpr std::size_t looked_at = 12;  // neighbours on the grid of a constant are one law
  // On a plan of equal dwells what turns only is seen at equal times: waves of several periods are then the same.
  constexpr std::size_t most_waves = 4;
  constexpr double another_period = 1.25;
  std::map<std::pair<int, std::string>, std::vector<double>> taken;  // constants of a pattern on an axis
  std::vector<Candidate> all;
  for (const Ranked& ranked : model.rank(looked_at * most)) {
    const Function& function = dictionary_.functions[static_cast<std::size_t>(ranked.function)];
    std::string key = dictionary_.pattern(function);
    if (function.kernel == Kernel::step) {
      key += std::to_string(function.constant);
    }
    std::vector<double>& others = taken[{ranked.axis, key}];
    const bool wave_apart = is_wave(function.kernel) && others.size() < most_waves &&
                            std::all_of(others.begin(), others.end(), [&](double other) {
                              return std::max(other / function.constant, function.constant / other) > another_period;
                            });
    if (ranked.gain <= 0.0 || !(others.empty() || wave_apart)) {
      continue;
    }
    others.push_back(function.constant);
    all.push_back(candidate(model, ranked));
    if (all.size() == most) {
      break;
    }
  }
  std::sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) { return a.merit() > b.merit(); });
  return all;
}

std::array<Candidate, 2> Shortlist::refined(PieceModel& model, const Ranked& first, const Ranked& second) const {
  std::array<Candidate, 2> both = {candidate(model, first), candidate(model, second)};
  for (const std::size_t k : {0U, 1U}) {
    std::vector<Eigen::VectorXd> columns;
    add_columns(model, both[1 - k].term, columns);
    model.choose(columns);
    both[k] = candidate(model, k == 0 ? first : second);
  }
  model.choose({});
  return both;
}

void Shortlist::add_columns(const PieceModel& model, const LawTerm& term, std::vector<Eigen::VectorXd>& columns) const {
  const auto column = [&](const std::vector<double>& constants) -> Eigen::VectorXd {
    return model.column(term.axis, sums_.means(term.expression.evaluate(sums_.channels, constants)));
  };
  const Eigen::VectorXd base = column(term.constants);
  columns.push_back(base);
  for (std::size_t k = 0; k < term.constants.size(); ++k) {
    std::vector<double> moved = term.constants;
    const double step = 1e-3 * std::max(std::abs(moved[k]), 1e-6);
    moved[k] += step;
    const Eigen::VectorXd up = column(moved);
    const Eigen::VectorXd derivative = (up - base) / step;
    if (derivative.norm() > 0.0) {
      columns.push_back(derivative);
    }
  }
}

void Shortlist::limit(LawTerm& term, Kernel kernel) const {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (const Factor& factor : dictionary_.factors) {
    if (factor.kernel == kernel) {
      least = std::min(least, factor.constant);
      most = std::max(most, factor.constant);
    }
  }
  term.least = 0.5 * least;
  term.most = 2.0 * most;
}

double Shortlist::spacing_of(Kernel kernel) const {
  std::set<double> constants;
  for (const Factor& factor : dictionary_.factors) {
    if (factor.kernel == kernel) {
      constants.insert(factor.constant);
    }
  }
  return constants.size() < 2
             ? 0.0
             : std::log(*constants.rbegin() / *constants.begin()) / static_cast<double>(constants.size() - 1);
}

std::vector<Constant> Shortlist::constants(const LawTerm& term) const {
  const std::string text = term.expression.text();
  std::vector<Constant> all;
  if (term.constants.empty()) {
    return all;
  }
  for (const WaveForm& form : {over_time, over_turns}) {
    if (text.find(form.with_phase) != std::string::npos) {
      return {{"period", std::string(form.unit), term.constants[0], 0.0}, {"phase", "rad", term.constants[1], 0.0}};
    }
  }
  if (text.find("1+?") != std::string::npos && text.find("/?") == std::string::npos) {
    return {{"offset", "1", term.constants[0], 0.0}};
  }
  for (std::size_t k = 0; k < term.constants.size(); ++k) {
    const bool seconds = text.find("since/?") != std::string::npos || text.find("rest/?") != std::string::npos;
    const bool step = text.find("t-?") != std::string::npos;
    all.push_back({step ? "at" : "tau", seconds ? "s" : "h", term.constants[k], 0.0});
  }
  return all;
}

}  // namespace selfcal::discovery
