#include "estimator/diagnosis/empirical.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/regression/evidence.hpp"
#include "estimator/diagnosis/regression/signature_pass.hpp"
#include "estimator/diagnosis/search/locate.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t most_terms = 8;
constexpr int axes = 6;

using Function = double (*)(const EffectContext&);

// One function on all six axes.
template <Function function>
void on_all_axes(const EffectContext& c, double /*constant*/, Columns velocity, Columns angle) {
  const double integral = function(c) * c.dt;
  for (int k = 0; k < 3; ++k) {
    angle(k, k) = integral;
    velocity(k, 3 + k) = integral;
  }
}

template <Function function>
Effect smooth(const char* words) {
  Effect e;
  e.id = words;
  for (int k = 0; k < axes; ++k) {
    const double si = k < 3 ? units::degree_per_hour : units::micro_g;
    e.parameters.push_back({axis_ids[static_cast<std::size_t>(k)], k < 3 ? "deg/h" : "ug", si, map_unit(k) / si});
  }
  e.sensor = on_all_axes<function>;
  return e;
}

double middle(const EffectContext& c) { return (c.start_s + c.end_s) / c.duration_s - 1.0; }  // -1 to 1

template <int n>
double legendre(const EffectContext& c) {
  const double x = middle(c);
  if constexpr (n == 1) {
    return x;
  } else if constexpr (n == 2) {
    return 0.5 * (3.0 * x * x - 1.0);
  } else {
    return 0.5 * x * (5.0 * x * x - 3.0);
  }
}
template <int axis>
double gravity(const EffectContext& c) {
  return c.u(axis);
}
template <int i, int j>
double product(const EffectContext& c) {
  return c.u(i) * c.u(j);
}
template <int n>
double sine_outer(const EffectContext& c) {
  return std::sin(n * c.outer);
}
template <int n>
double cosine_outer(const EffectContext& c) {
  return std::cos(n * c.outer);
}
template <int n>
double sine_inner(const EffectContext& c) {
  return std::sin(n * c.inner);
}
template <int n>
double cosine_inner(const EffectContext& c) {
  return std::cos(n * c.inner);
}
double temperature(const EffectContext& c) { return c.temperature; }
double temperature_square(const EffectContext& c) { return c.temperature * c.temperature; }

std::vector<Effect> functions(const ImuData& data) {
  std::vector<Effect> all = {
      smooth<gravity<0>>("u_x"),        smooth<gravity<1>>("u_y"),        smooth<gravity<2>>("u_z"),
      smooth<product<0, 0>>("u_x^2"),   smooth<product<1, 1>>("u_y^2"),   smooth<product<2, 2>>("u_z^2"),
      smooth<product<0, 1>>("u_x u_y"), smooth<product<0, 2>>("u_x u_z"), smooth<product<1, 2>>("u_y u_z"),
      smooth<legendre<1>>("P1(time)"),  smooth<legendre<2>>("P2(time)"),  smooth<legendre<3>>("P3(time)")};
  if (!data.gimbal_outer.empty() && !data.gimbal_inner.empty()) {
    for (Effect& e :
         std::vector<Effect>{smooth<sine_outer<1>>("sin(outer)"), smooth<cosine_outer<1>>("cos(outer)"),
                             smooth<sine_outer<2>>("sin(2 outer)"), smooth<cosine_outer<2>>("cos(2 outer)"),
                             smooth<sine_inner<1>>("sin(inner)"), smooth<cosine_inner<1>>("cos(inner)"),
                             smooth<sine_inner<2>>("sin(2 inner)"), smooth<cosine_inner<2>>("cos(2 inner)")}) {
      all.push_back(std::move(e));
    }
  }
  if (!data.temperature.empty()) {
    all.push_back(smooth<temperature>("T - mean T"));
    all.push_back(smooth<temperature_square>("(T - mean T)^2"));
  }
  return all;
}

// What a sensor of this kind can put out wrongly at most, in typical sizes: the limit beyond which a bias or a drift of it is not
// plausible either.
double possible(int column) {
  const int axis = column % axes;
  const ParameterVector limit = plausible_limit();
  return (axis < 3 ? limit(3) : limit(0)) / map_unit(axis);
}

// Whether enough of a function is left beside the 24, the attitude and what was taken. One that shows less than 100 sigma at
// its largest possible size lies inside their span to a per cent of what could be there at all: what is left of it is a curve of another
// shape, and fits at a coefficient that says nothing of the function.
bool visible(double sigma, int column) {
  constexpr double least_significance = 100.0;
  return sigma * least_significance < possible(column);
}

// The column that gains most, if it is significant among all that were tried; -1: none.
int best_column(const Evidence& evidence, int columns, const std::vector<int>& chosen, double alpha) {
  const SingleTest test(evidence, chosen);
  int best = -1;
  double delta_chi2 = 0.0;
  for (int k = 0; k < columns; ++k) {
    const bool taken = std::find(chosen.begin(), chosen.end(), k) != chosen.end();
    const auto found = taken ? std::nullopt : test(k);
    if (!found || found->z * found->z <= delta_chi2 || !visible(std::abs(found->size / found->z), k) ||
        std::abs(found->size) > possible(k)) {
      continue;
    }
    delta_chi2 = found->z * found->z;
    best = k;
  }
  return log_corrected(log_chi_squared_tail(delta_chi2, 1.0), columns) < std::log(alpha) ? best : -1;
}

// Whether each coefficient is still one that a sensor can have: what is taken later may be nearly collinear with it.
bool sensible(const Fit& fit, const std::vector<int>& chosen) {
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    if (!visible(std::sqrt(fit.covariance(at, at)), chosen[k]) || std::abs(fit.value(at)) > possible(chosen[k])) {
      return false;
    }
  }
  return true;
}

}  // namespace

namespace {

// Significant columns that predict what was left out, and what each gained there, in the order in which they were taken.
struct Taken {
  std::vector<int> columns;
  std::vector<double> held_out_gain;
};

Taken take_columns(const SignatureRows& rows, const Evidence& evidence, const std::vector<int>& fold, int count,
                   double false_alarm_rate) {
  Taken taken;
  while (taken.columns.size() < most_terms) {
    const int column = best_column(evidence, count, taken.columns, false_alarm_rate);
    if (column < 0) {
      break;
    }
    std::vector<int> with = taken.columns;
    with.push_back(column);
    const double gain = held_out_gain(rows.columns, rows.residual, fold, with, taken.columns);
    if (gain <= 0.0 || !sensible(evidence.fit(with), with)) {
      break;
    }
    taken.columns = std::move(with);
    taken.held_out_gain.push_back(gain);
  }
  return taken;
}

}  // namespace

EmpiricalDescription describe_empirically(const ImuData& data, const Diagnosis& d, double false_alarm_rate) {
  const std::vector<Effect> all = functions(data);
  std::vector<Candidate> candidates;
  candidates.reserve(all.size());
  for (const Effect& e : all) {
    candidates.push_back({&e, NAN, 0, 0});
  }
  const RecordingContext context(data);
  SignaturePass pass(context, candidates, false);
  const SignatureRows rows = pass.run(forward_pass(data, d.calibration));
  const Evidence evidence(rows);
  std::vector<int> fold;
  for (const double t : rows.time_s) {
    fold.push_back(static_cast<int>(context.segment_at(t)));
  }
  const Taken taken = take_columns(rows, evidence, fold, pass.count(), false_alarm_rate);
  EmpiricalDescription result;
  if (taken.columns.empty()) {
    return result;
  }
  const Fit fit = evidence.fit(taken.columns);
  for (std::size_t k = 0; k < taken.columns.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const auto axis = static_cast<std::size_t>(taken.columns[k] % axes);
    const Effect& effect = all[static_cast<std::size_t>(taken.columns[k] / axes)];
    const EffectParameter& p = effect.parameters[axis];
    result.terms.push_back({axis_ids[axis], effect.id, p.unit, fit.value(at) * p.typical,
                            std::sqrt(fit.covariance(at, at)) * p.typical, taken.held_out_gain[k]});
    result.held_out_gain += taken.held_out_gain[k];
  }
  result.share = std::min(1.0, fit.delta_chi2 / std::max(1.0, evidence.square - evidence.rows));
  return result;
}

}  // namespace selfcal::diagnosis
