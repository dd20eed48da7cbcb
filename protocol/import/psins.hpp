// The header of a PSINS IMU file (.imu, G. Yan): initial values and scale factors in three lines before the samples.
#pragma once

#include <array>
#include <optional>
#include <string>

namespace selfcal::import {

struct PsinsHeader {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double height_m = 0.0;
  double interval_s = 0.0;
  std::array<double, 3> gyro_arcsec{};        // of a count
  std::array<double, 3> accelerometer_mps{};  // of a count, by the gravity that the file states
};

// PREAMBLE: the lines before the samples. nullopt: not such a file, or its header is not as its own words say.
std::optional<PsinsHeader> read_psins(const std::string& preamble);

}  // namespace selfcal::import
