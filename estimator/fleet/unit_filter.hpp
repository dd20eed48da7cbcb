// One parameter of one unit over the years, by the model of its type.
//
//   y = m + u + (r0 + r) t + w(t) + v(t) + b + e                                                    (F1)
//   dv = -v / T dt + s sqrt(2 / T) dB,   v(0) = v0 + departure of the unit                          (F2)
//
// y: value that a calibration measured, t: years since the unit's first calibration, m: the type's mean, u: the unit's own
// departure, r0 + r: the type's ramp and the unit's own, w: random walk, v: what comes back (a new unit settles by it, an old one
// wanders by it), b: offset of the set that measured, e: set-up noise and the sigma that the calibration itself states. u, r, b, e,
// the departure of v(0) and the steps of w and B are normal with zero mean. The unit of value is the caller's; time in years.
#pragma once

#include <array>
#include <vector>

namespace selfcal::fleet {

struct Measurement {
  int set = 0;        // 0 ... sets - 1
  double year = 0.0;  // any epoch, the same for all
  double value = 0.0;
  double sigma = 0.0;  // as the calibration states it
};

using UnitHistory = std::vector<Measurement>;  // in the order of time

// Standard deviations of (F1) and (F2), and T.
struct Ageing {
  double unit_sd = 0.0, ramp_sd = 0.0;  // between units
  double walk_sd = 0.0;                 // per square root of a year
  double setup_sd = 0.0;                // beyond a calibration's own sigma
  double settling_sd = 0.0;             // of v when new, between units
  double wander_sd = 0.0;               // of v in the long run
  double return_years = 0.0;            // T, in which v falls to 1/e; 0: there is no v
};

struct SetOffset {
  double value = 0.0;  // towards zero by what is known of sets
  double sigma = 0.0;
  int measurements = 0;
};

struct TypeModel : Ageing {
  double mean = 0.0, ramp_per_year = 0.0;
  double settling = 0.0;  // v0
  double set_sd = 0.0;    // between sets; by the median, so that one that is wrong does not widen it
  // Where the walk goes by jumps (jumps.hpp): walk_sd^2 = jumps_per_year jump_sd^2. 0: it is normal.
  double jumps_per_year = 0.0, jump_sd = 0.0;
  std::vector<SetOffset> sets;
};

// Covariance of level (m + u + w), ramp and v, which depends on times and sigmas alone.
class UnitCovariance {
 public:
  explicit UnitCovariance(const Ageing& ageing);
  // The factor that v falls by meanwhile.
  double advance(double years);
  double variance() const { return p_[0] + 2.0 * p_[2] + p_[5]; }  // of the true value
  double slope_variance() const;                                   // of what it is expected to change by in a year
  // d/ds of the covariance of the values at s and t, s -> t from below: b in Durbin's (F3) of interval.hpp.
  double approach() const;
  // By a measurement with this variance of its own: gains of level, ramp and v.
  std::array<double, 3> take(double noise_variance);

 private:
  double return_rate() const { return ageing_.return_years > 0.0 ? 1.0 / ageing_.return_years : 0.0; }
  Ageing ageing_;
  std::array<double, 6> p_;  // upper triangle, by rows
};

// What a filter knows of a unit at `year`.
struct UnitState {
  double year = 0.0;
  double level = 0.0, ramp = 0.0, returning = 0.0;  // m + u + w; r0 + r; v
  double return_rate = 0.0;                         // 1 / T
  UnitCovariance covariance;

  double value() const { return level + returning; }
  double sigma() const;
  double slope() const { return ramp - return_rate * returning; }  // expected change a year
  double slope_sigma() const;
};

struct Innovation {
  double value = 0.0, variance = 0.0;  // what a measurement differs by from what was expected of it
};

// One unit by the model of its type, which outlives it. Without a measurement it stands where the type's new units do.
class UnitFilter {
 public:
  UnitFilter(const TypeModel& model, double first_year);
  Innovation add(const Measurement& measurement);
  UnitState at(double year) const;  // of the true value; not before the last measurement
  const TypeModel& model() const { return *model_; }
  // Of a calibration that states `sigma`, by whichever set.
  double variance_of_measurement(double year, double sigma) const;

 private:
  const TypeModel* model_;
  UnitState state_;
};

}  // namespace selfcal::fleet
