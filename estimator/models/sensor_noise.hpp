// Noise of the sensors, from the dwells of a recording.
#pragma once

#include <vector>

#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal {

struct TriadNoise {
  double white_asd = 0.0;        // angle or velocity random walk: rad/s/sqrt(Hz), m/s^2/sqrt(Hz); mean of the axes
  double white_sigma = 0.0;      // of it, where the fit states one (gyros with a quantum on a still base); 0: none
  double increment_sigma = 0.0;  // white noise of the integral itself (quantisation and the like): rad, m/s
  double quantum = 0.0;          // smallest step of which all increments are multiples: rad, m/s; 0: none found
};

struct SensorNoise {
  TriadNoise gyro, accel;
  bool base_moves = false;  // 1 s increments vary by far more than the noise: moored, or disturbed
  std::size_t spectra = 0;  // pieces averaged; 0: the recording was too short to say anything
};

// As the recording says, or as its increments show.
Quanta find_quanta(const ImuData& data);

// Mean periodogram of the dwells, in a band chosen by whether the base moves (see the constants in the source), fitted with N^2 + 4 sin^2(pi f D)/D Q^2 (white rate plus white angle; IEEE Std 952, annex C) with spectral lines
// left out. Gyros with a quantum on a still base: quantised_rate.hpp.
SensorNoise estimate_sensor_noise(const ImuData& data, const std::vector<Segment>& segments);

}  // namespace selfcal
