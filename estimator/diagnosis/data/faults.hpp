// Faults of the data themselves, looked for before any physics: what they do to the filter looks like anything.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

// Samples [first, last) that a fault spoils; the gyros' among them or only the accelerometers'.
struct FaultyStretch {
  std::size_t first = 0, last = 0;
  bool gyros = true;
};

struct DataFault {
  // lost_samples, time_base, frozen_axis, spike, saturation, read_out, temperature, wrong_axes, wrong_sign, wrong_scale, wrong_read_out, wrong_site
  std::string id;
  std::string words;  // what is wrong, by what it shows, and what mends it
  std::size_t first_sample = 0;
  std::size_t count = 0;  // samples concerned
  // All of it, where it is a fault of a part of the recording; empty: of the whole.
  std::vector<FaultyStretch> stretches = {};
};

// Empty; or that no reading of either triad ever changes, and not even noise is there.
std::string no_readings(std::span<const std::array<double, 3>> gyro, std::span<const std::array<double, 3>> accel);

// Each kind at most once, with its first sample and how many there are.
std::vector<DataFault> find_data_faults(const ImuData& data);

}  // namespace selfcal::diagnosis
