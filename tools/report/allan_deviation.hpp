// Allan deviation of the six sensors, from the dwells of a recording.
#pragma once

#include <array>
#include <vector>

#include "estimator/models/segments.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::report {

struct AllanPoint {
  double tau_s = 0.0;
  std::array<double, 6> deviation{};  // gyro x y z in rad/s, accelerometer x y z in m/s^2
  std::size_t differences = 0;        // averaged
  double freedom = 0.0;               // equivalent chi-squared degrees of freedom of each variance
};

// Overlapping estimator (IEEE Std 952-1997, annex C) on the integrals of each dwell, pooled over the dwells: every
// dwell has its own mean, so the turns between them do not count. About ten clusters a decade, up to a third of the
// longest dwell. Empty where no dwell is long enough. The degrees of freedom are the lesser of those
// of white noise and of a rate random walk (NIST SP 1065, table 5: white FM, random-walk FM).
std::vector<AllanPoint> allan_deviation(const Recording& recording, const std::vector<Segment>& segments);

}  // namespace selfcal::report
