// What a schedule will give, before anything turns: covariance analysis of the calibration on ideal motion.
//
// The same interval model and the same filter as the calibration itself; only the data are missing. The covariance of
// a linear filter does not need them.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/schedule.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal {

// Where and with what the INS is to be calibrated. SI and radians.
struct Installation {
  Attitude attitude;  // of the vehicle
  earth::Position site;
  double gyro_arw = 0.0;         // rad/s/sqrt(Hz)
  double accel_vrw = 0.0;        // m/s^2/sqrt(Hz)
  double position_sigma = 1e-5;  // m, white, at 1 Hz; a still base stands to micrometres
  ParameterVector tolerance = default_tolerance();
};

struct PositionForecast {
  double end_s = 0.0;     // of the dwell
  ParameterVector sigma;  // after it, SI
};

struct Plan {
  double duration_s = 0.0;
  ParameterVector sigma;       // SI
  ParameterMatrix covariance;  // SI
  std::array<bool, sensor_parameter_count> determined{};
  std::vector<PositionForecast> history;  // one per position
  std::vector<UndeterminedDirection> undetermined;
  bool meets_tolerances() const;
};

Plan predict(const Schedule& schedule, const Installation& installation);

// Limits of the search for a schedule: moves of one axis at a time by 90 deg, each lasting rotation_s.
struct SearchOptions {
  double rotation_s = 5.0;
  double longest_s = 3600.0;  // no schedule beyond this
  int beam = 48;              // partial schedules kept at each depth
  std::vector<double> dwells_s = {10, 15, 20, 30, 45, 60, 90, 150};
};

struct SearchResult {
  Schedule schedule;
  Plan plan;
  bool found = false;  // false: the best that longest_s allows, tolerances not met
  int evaluated = 0;   // partial schedules looked at
};

// Searches positions and dwell times for the shortest schedule that meets the tolerances: beam search over the moves
// for each dwell time, then the last dwells drawn out or cut so far as the tolerances need. Parameters with an infinite
// tolerance do not count. `progress` (may be empty) hears the fraction done.
SearchResult search_schedule(const Installation& installation, const SearchOptions& options,
                             const std::function<void(double)>& progress = {});

}  // namespace selfcal
