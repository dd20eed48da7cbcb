// Tables of means: a row a pose, as laboratories publish tests in 6, 12 or 24 positions. No log stands behind them, so that what each is known to
// follows from what the rows leave of |f| = g, where they are enough, or from standard deviations that the table gives.
#pragma once

#include <array>
#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {

struct PoseMeans {
  PoseInput rows;      // means, a row a pose, and what is known of their units, the place, the temperature, degC
  bool timed = false;  // whether `rows.time_s` says when a row was taken; else the order says nothing of time
  // Standard deviations of the readings of each row, unit of `rows.accel`: a mean is known at least so far. Empty: none given.
  std::vector<std::array<double, 3>> accel_deviation;
  std::array<double, 3> accel_digit{}, gyro_digit{};  // the last digit that the table writes, units of `rows`
};

// Accelerometers by |f| = g, effects in them where the rows are enough, and the gyros' bias with what goes with the pose. `failure`: fewer than
// six rows; rows that leave nothing over, and no deviations; gyros that turn; forces of all sizes; a row that does not belong to the others.
PoseDiagnosis diagnose_means(const PoseMeans& means, double false_alarm_rate);

}  // namespace selfcal::diagnosis
