// How one parameter of many units of a type varies, fitted over all of them at once, and what follows for each unit.
//
//   y = m + u + (r0 + r) t + w(t) + b + e          (F1)
//
// y: value that a calibration measured, t: years since the unit's first calibration, m: the type's mean, u: the unit's own
// departure, r0 + r: the type's ramp and the unit's own, w: random walk, b: offset of the set that measured, e: set-up noise
// and the sigma that the calibration itself states. u, r, b, e and the steps of w are normal with zero mean.
//
// The variances maximise the restricted likelihood (REML: Patterson & Thompson, Biometrika 58, 1971), which a Kalman filter
// over each unit gives by its innovations (Harvey, Forecasting, Structural Time Series Models, 1989, 3.4); m, r0 and b follow
// by generalised least squares on the same innovations. The unit of value is the caller's; time in years.
#pragma once

#include <array>
#include <span>
#include <vector>

namespace selfcal::fleet {

struct Measurement {
  int set = 0;        // 0 ... sets - 1
  double year = 0.0;  // any epoch, the same for all
  double value = 0.0;
  double sigma = 0.0;  // as the calibration states it
};

using UnitHistory = std::vector<Measurement>;  // in the order of time

struct SetOffset {
  double value = 0.0;  // towards zero by what is known of sets
  double sigma = 0.0;
  int measurements = 0;
};

struct TypeModel {
  double mean = 0.0, ramp_per_year = 0.0;
  double unit_sd = 0.0, ramp_sd = 0.0;  // between units
  double walk_sd = 0.0;                 // per square root of a year
  double setup_sd = 0.0;                // beyond a calibration's own sigma
  double set_sd = 0.0;                  // between sets; by the median, so that one that is wrong does not widen it
  std::vector<SetOffset> sets;
};

// Nothing can be told of a type from fewer than three units or ten measurements: all zero then but for the mean, and a unit_sd
// that covers what was seen.
TypeModel fit_type(std::span<const UnitHistory> units, int sets);

// What a filter knows of a unit: level and ramp at `year`.
struct UnitState {
  double year = 0.0;
  double level = 0.0, ramp = 0.0;
  std::array<double, 3> covariance{};  // of level, of level with ramp, of ramp
};

struct Innovation {
  double value = 0.0, variance = 0.0;  // what a measurement differs by from what was expected of it
};

// One unit by the model of its type. Without a measurement it stands at the type's mean.
class UnitFilter {
 public:
  UnitFilter(const TypeModel& model, double first_year);
  Innovation add(const Measurement& measurement);
  UnitState at(double year) const;  // of the true value; not before the last measurement
  // Of a calibration that states `sigma`, by whichever set.
  double variance_of_measurement(double year, double sigma) const;

 private:
  const TypeModel* model_;
  UnitState state_;
};

// Years from the last calibration until the probability that the true value has left `measured` (which is compensated since
// then) by more than the limit in any of the parameters reaches `risk`; between `least` and `most`. One filter, measured value
// and limit for each parameter; a limit of 0 is none.
struct Watched {
  const UnitFilter* filter = nullptr;
  double measured = 0.0;
  double limit = 0.0;
};
double interval_years(std::span<const Watched> parameters, double last_year, double risk, double least, double most);

}  // namespace selfcal::fleet
