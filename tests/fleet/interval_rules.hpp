// Rules by which a unit's next calibration is set, tried on units that age by their own law (drawn_fleet.hpp).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "estimator/fleet/unit_filter.hpp"
#include "tests/fleet/drawn_fleet.hpp"

namespace selfcal::fleet {

// What a rule is given after each calibration of a unit; elements by parameter.
struct Calibration {
  double year = 0.0, before = 0.0;            // when; and the interval before it, 0 at the first
  std::vector<double> found, previous;        // what was measured now and last
  std::vector<AgeingValue>* truth = nullptr;  // of the parameters, for those who are to know it
};

// Of one unit.
class IntervalRule {
 public:
  virtual ~IntervalRule() = default;
  virtual double next_years(const Calibration& now) = 0;
};

using MakeRule = std::function<std::unique_ptr<IntervalRule>()>;

MakeRule fixed_year();
MakeRule staircase(double limit);      // ILAC-G24, method 1
MakeRule control_chart(double limit);  // ILAC-G24, method 2
MakeRule by_forecast(const std::vector<TypeModel>& models, double limit, double risk);
// Who knows the law and, with `truth`, where each part stands: until the rate of leaving reaches `rate` a year, which is how a
// given number of departures is spent on as few calibrations as can be.
MakeRule oracle(const Nature& nature, std::size_t parameters, double limit, double rate, bool truth);

struct Outcome {
  int calibrations = 0, intervals = 0, left = 0;  // left: its limits within the interval
  int looks = 0, beyond = 0;                      // units looked at every two days; beyond their limits then
  double within() const { return 100.0 - 100.0 * left / std::max(1, intervals); }
  double sound() const { return 100.0 - 100.0 * beyond / std::max(1, looks); }
};

// So many years of each unit by one rule, looked at every two days; the truth is the same for each rule, the noise of each
// calibration is not (`which`). `limit` of the change in sigmas of a calibration.
Outcome live(int units, double years, const Nature& nature, std::size_t parameters, double limit, std::uint64_t seed,
             int which, const MakeRule& make);

}  // namespace selfcal::fleet
