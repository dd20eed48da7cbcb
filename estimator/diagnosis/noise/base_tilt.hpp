// Whether a base on which nothing turns tilts: what the gyros integrate to and what gravity shows are then one motion, no error of a sensor.
#pragma once

#include <optional>
#include <vector>

#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

struct BaseTilt {
  double range = 0.0;  // rad: largest less least of 10 s means, about the level axis on which it is larger, by gravity
  double correlation = 0.0;  // of both, each less its straight line: a gyro's drift is one
  double apart = 0.0;        // rad rms: what they differ by
};

// nullopt: less than two minutes in one attitude, or they do not agree (correlation below 0.9, or apart by more than a quarter).
std::optional<BaseTilt> base_tilt(const ImuData& data, const std::vector<Segment>& segments);

}  // namespace selfcal::diagnosis
