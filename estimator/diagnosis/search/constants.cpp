#include "estimator/diagnosis/search/constants.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

namespace selfcal::diagnosis {
namespace {

constexpr int steps = 3;  // of a constant to either side
constexpr int most_moves = 8;

bool of_spectrum(const Effect& effect) { return effect.constant.kind == EffectConstant::Kind::spectrum; }

// Gain of term i with its constant `steps` steps of the logarithm to either side.
std::vector<double> gains_around(const RecordingContext& context, const OperatingPoint& point, const Hypothesis& h,
                                 std::size_t i, double step) {
  const Term& own = h.terms[i];
  std::vector<Variant> grid;
  for (int k = -steps; k <= steps; ++k) {
    const double constant = own.constant * std::exp(k * step);
    grid.push_back({own.effect, constant, constant});
  }
  const LinearModel model = LinearModel::about(context, point, without_term(h, i), grid, false);
  std::vector<double> delta_chi2;
  for (const Candidate& c : model.alternatives()) {
    delta_chi2.push_back(model.test(c).delta_chi2);
  }
  return delta_chi2;
}

// Where the parabola through Δχ² has its top.
struct Top {
  double offset = 0.0;  // steps from the middle of the grid
  double sigma = 0.0;   // steps; 0: no top
  bool at_edge = false;
};

Top top_of(const std::vector<double>& delta_chi2) {
  const auto top = std::max_element(delta_chi2.begin(), delta_chi2.end()) - delta_chi2.begin();
  const auto middle = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(top, 1, 2 * steps - 1));
  const double curvature = delta_chi2[middle - 1] - 2.0 * delta_chi2[middle] + delta_chi2[middle + 1];
  const double slope = 0.5 * (delta_chi2[middle + 1] - delta_chi2[middle - 1]);
  const double offset = curvature < 0.0 ? std::clamp(-slope / curvature, -1.0, 1.0) : 0.0;
  // Δχ² = -2 log likelihood: sigma^2 = -2 / (second derivative).
  const double sigma = curvature < 0.0 ? std::sqrt(-2.0 / curvature) : 0.0;
  return {static_cast<double>(middle) - steps + offset, sigma, top == 0 || top + 1 == std::ssize(delta_chi2)};
}

// The catalogue's grid may be wide: the top is followed along it, and by a factor of 2 beyond. A frequency has none.
bool within_reach(const Effect& effect, double constant) {
  const std::span<const double> all = effect.constant.grid;
  return !all.empty() && constant >= 0.5 * *std::min_element(all.begin(), all.end()) &&
         constant <= 2.0 * *std::max_element(all.begin(), all.end());
}

}  // namespace

Selection with_constant_followed(const RecordingContext& context, const Stage& about, Selection selection,
                                 std::size_t i) {
  Term& term = selection.hypothesis.terms[i];
  if (std::isnan(term.constant)) {
    return selection;
  }
  // A frequency comes from a spectrum: it lies within half a bin.
  const double bin = 1.0 / (term.constant * about.model.rows().time_s.back());
  const double coarse = of_spectrum(*term.effect) ? 0.25 * bin : 0.2;
  for (const double step : {coarse, 0.2 * coarse}) {
    for (int move = 0; move < most_moves; ++move) {
      const Top top = top_of(gains_around(context, about.point, selection.hypothesis, i, step));
      term.constant *= std::exp(top.offset * step);
      term.constant_sigma = term.constant * step * top.sigma;
      if (!top.at_edge || !within_reach(*term.effect, term.constant)) {
        break;
      }
    }
  }
  for (Variant& v : selection.alternatives) {
    v.constant = same(v, term) ? term.constant : v.constant;
  }
  return selection;
}

Selection with_constants_followed(const RecordingContext& context, const Stage& about, Selection selection,
                                  bool newest) {
  const std::size_t count = selection.hypothesis.terms.size();
  if (newest) {
    selection = with_constant_followed(context, about, std::move(selection), count - 1);
  }
  for (std::size_t i = 0; i + (newest ? 1 : 0) < count; ++i) {
    selection = with_constant_followed(context, about, std::move(selection), i);
  }
  return selection;
}

namespace {

// Constants beside a term's own: so many sigmas of the logarithm apart, further out by a share of the distance.
constexpr double constants_apart = 0.5, constants_spread = 0.25;
constexpr double furthest_apart = 0.5;  // of the logarithm

// Constants that a term may have beside its own, in order: close where the likelihood's curvature says, for it may be anything
// but a parabola out to the ends of the catalogue's grid and a factor of 2 beyond. A frequency is sharp: its derivative will do.
std::vector<double> constants_about(const Term& term) {
  const std::span<const double> grid = term.effect->constant.grid;
  if (grid.empty()) {
    return {};
  }
  const auto [smallest, largest] = std::minmax_element(grid.begin(), grid.end());
  const double own = term.constant;
  const double down = std::log(own / (0.5 * *smallest)), up = std::log(2.0 * *largest / own);
  const double apart = term.constant_sigma > 0.0 ? constants_apart * term.constant_sigma / own : furthest_apart;
  std::vector<double> all = {own};
  for (double offset = 0.0; offset < std::max(down, up);) {
    offset += std::min(std::max(apart, constants_spread * offset), furthest_apart);
    if (offset < down) {
      all.insert(all.begin(), own * std::exp(-offset));
    }
    if (offset < up) {
      all.push_back(own * std::exp(offset));
    }
  }
  return all;
}

// Half of the step of the logarithm that makes the derivative. A frequency may shift the phase by an eighth of a radian over
// the recording.
double half_step(const Term& term, double duration_s) {
  return of_spectrum(*term.effect) ? 0.02 / (term.constant * duration_s) : 0.05;
}

}  // namespace

WithConstants with_constants(const RecordingContext& context, const Stage& stage) {
  WithConstants with{stage.model, {}};
  const std::vector<Term>& terms = stage.hypothesis().terms;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Term& term = terms[i];
    PlacedTerm placed{stage.model.terms()[i], term.amplitude, term.constant_sigma, -1, {}};
    if (!std::isnan(term.constant)) {
      const double h = half_step(term, stage.model.rows().time_s.back());
      std::vector<Candidate> more = {{term.effect, term.constant * std::exp(h), 0, 0},
                                     {term.effect, term.constant * std::exp(-h), 0, 0}};
      for (const double constant : constants_about(term)) {
        more.push_back({term.effect, constant, 0, 0});
      }
      SignaturePass pass(context, std::move(more), false);
      const SignatureRows rows = pass.run(stage.point.pass(stage.hypothesis().noise));
      const Eigen::Index count = placed.candidate.count, beside = rows.columns.cols() - 2 * count;
      const auto difference_and_others = [&](const Eigen::MatrixXd& m) {
        Eigen::MatrixXd all(m.rows(), count + beside);
        all << (m.leftCols(count) - m.middleCols(count, count)) / (2.0 * h), m.rightCols(beside);
        return all;
      };
      placed.derivative = with.model.append(difference_and_others(rows.columns), difference_and_others(rows.shift));
      for (std::size_t k = 2; k < pass.candidates().size(); ++k) {
        placed.constants.push_back(pass.candidates()[k]);
        placed.constants.back().first += placed.derivative - static_cast<int>(count);
      }
    }
    with.terms.push_back(std::move(placed));
  }
  return with;
}

}  // namespace selfcal::diagnosis
