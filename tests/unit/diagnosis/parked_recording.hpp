// A recording made up by a test, in which nothing turns: what the sensors of a parked base put out.
#pragma once

#include <array>
#include <vector>

#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

struct ParkedRecording {
  double rate_hz = 20.0;
  std::vector<double> time_s;
  std::vector<std::array<double, 3>> delta_theta, delta_v;

  // A view: the recording must outlive it.
  ImuData data() const {
    ImuData all;
    all.sample_rate_hz = rate_hz;
    all.time_s = time_s;
    all.delta_theta = delta_theta;
    all.delta_v = delta_v;
    return all;
  }
};

}  // namespace selfcal::diagnosis
