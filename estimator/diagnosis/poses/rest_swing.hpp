// What swings while the sensor rests: a line of its own, or a base that is rocked. Private to this folder.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct Swing {
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // raw
  double white_asd = 0.0;  // beside it, raw sqrt(s)
};

// The strongest line between 1/32 and 4 Hz of an axis in the poses' undisturbed stretches, where it is none of white noise with a probability
// of 1e-6. Below 32 s there is no answer. The white noise is that of the quietest octave between 1/16 and 2 Hz, each by the median of its
// bins, which lines do not move (mean periodogram over Hann windows: Welch 1967).
std::optional<Swing> find_swing(const std::vector<std::array<double, 3>>& series, std::size_t axis, double rate_hz,
                                const std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
