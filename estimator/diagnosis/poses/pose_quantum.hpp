// What the quantum of a reading hides where the noise is less than it. Private to this folder.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// The smallest step of what steps at all, raw; 0: it stands throughout.
double quantum_of(const std::vector<std::array<double, 3>>& series, std::size_t axis, std::size_t first,
                  std::size_t last);

// Sigma, in quanta, of what a mean is off by where noise of VARIANCE (of a reading in quanta, as it is seen from sample to sample) does not reach
// over the quantum: the mean of q / (pi k) exp(-2 pi^2 k^2 (sigma/q)^2) sin(2 pi k x / q), k = 1, 2 ... (Widrow and Kollar 2008), over all x. Its
// square is a twelfth where nothing scatters.
double hidden_by_quantum(double variance);

// Of an axis that reads one value in all rests, as gyros do that their device sets to zero: how far the nearest other value of the log is, HUGE_VAL
// where it has none. 0: it reads several.
double silent_band(const std::vector<std::array<double, 3>>& series, std::size_t axis, const std::vector<Pose>& poses);

// Sigma of a mean in such a band: that of all values in it; of one no wider than two quanta what the quantum hides.
double hidden_by_band(double band, double quantum);

// Which gyros read one value in all rests, and how near to it their bias is, in words; empty: none.
std::string silent_gyros(const PoseInput& input, const std::vector<Pose>& poses);

// Fills `gyro_hidden` and `accel_hidden` of the poses. Poses in which an axis reads the same to a quantum are off by the same: their sigma is as
// much larger as makes that of their mean no smaller than one's.
void add_hidden(const PoseInput& input, std::vector<Pose>& poses);

}  // namespace selfcal::diagnosis
