// The stochastic part: noise densities, quantisation and lines of the dwells against what the simulation assumes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

struct AssumedNoise {
  double gyro_arw = 0.0;       // rad/s/sqrt(Hz)
  double accel_vrw = 0.0;      // m/s^2/sqrt(Hz)
  double gyro_quantum = 0.0;   // rad
  double accel_quantum = 0.0;  // m/s
};

struct AxisNoise {
  double white_asd = 0.0;        // as AssumedNoise
  double white_sigma = 0.0;      // of the estimate
  double increment_sigma = 0.0;  // white noise of the integral: quantum/sqrt(12) where nothing else, rad or m/s
  double increment_variance_sigma = 0.0;  // of the estimate of its square
};

struct VibrationLine {
  int axis = 0;  // 0..2 gyro, 3..5 accelerometer
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // rad/s or m/s^2
  double log_p = 0.0;      // corrected for frequencies and axes
  bool beat = false;       // of the quantum with the rate of the dwell in which it is strongest
};

constexpr int enough_noise_pieces = 20;

struct NoiseCheck {
  std::array<AxisNoise, 6> axes;
  std::vector<VibrationLine> lines;
  int pieces = 0;  // of spectra averaged; below enough_noise_pieces nothing is judged
};

// Periodograms of pieces of the dwells (Hann), shorter where the dwells are. White rate plus white angle are fitted where
// lines are not; a line must stand out in the median over the dwells. The beat of a coarse quantum with a steady rate moves with the
// attitude: where that of `quanta` would be as strong, a dwell tells nothing of lines, and where half of them tell nothing there is none.
NoiseCheck check_noise(const ImuData& data, const std::vector<Segment>& segments, const Quanta& quanta = {});

}  // namespace selfcal::diagnosis
