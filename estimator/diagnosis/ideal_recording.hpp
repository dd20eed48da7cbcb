// Increments of perfect sensors on a still base that follows a schedule: what signatures of a planned recording need.
#pragma once

#include <array>
#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/schedule.hpp"
#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

// `ramp`: how a move's rate rises and falls (turn_ramp.hpp), 1 - cos over all of the move if nothing else is said. The angle increments are exact; the velocity increments are those of the
// attitude at each sample's middle, which moves signatures by the square of the turn within a sample, 1e-3.
class IdealRecording {
 public:
  IdealRecording(const Schedule& schedule, const Attitude& vehicle, const earth::Position& site, double rate_hz,
                 double ramp = 0.5);
  IdealRecording(const IdealRecording&) = delete;
  IdealRecording& operator=(const IdealRecording&) = delete;

  const ImuData& data() const { return data_; }
  const Matrix3& C_nb_start() const { return C_nb_start_; }

 private:
  std::vector<double> time_s_, outer_, inner_;
  std::vector<std::array<double, 3>> delta_theta_, delta_v_;
  Matrix3 C_nb_start_;
  ImuData data_;
};

}  // namespace selfcal::diagnosis
