// A gimbal that is told each move by itself, and the IMU on it. INS time throughout.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "protocol/error.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/device/scenario.hpp"
#include "sim_ins/imu_simulator.hpp"

namespace selfcal::sim {

class CommandedGimbal {
 public:
  CommandedGimbal(const SimConfig& config, std::uint64_t seed, const ConcealedPhysics& physics,
                  const Scenario& scenario);

  void power_on(double now_s);
  // rad. Not heard while it turns. Of the scenario's gimbal faults that of move k strikes the k-th move since start().
  void turn_to(std::array<double, 2> target, double now_s);
  // The IMU's samples from now on: the run's time begins.
  [[nodiscard]] Expected<void> start(double now_s);
  void stop(double now_s);  // the samples and all motion

  bool streaming() const { return imu_ != nullptr; }
  bool turning(double now_s) const;
  std::array<double, 2> angles(double now_s) const;  // rad
  // Samples that are due; those that were lost on the way are among them, as `missing`.
  std::vector<ImuSample> take(double now_s);

 private:
  double since_epoch(double now_s) const { return now_s - epoch_s_; }
  void stand(std::array<double, 2> where, double now_s);
  [[nodiscard]] Expected<void> make_imu();
  void repeat();  // up to the samples that were told
  double duration_of(const GimbalMove& move) const;

  SimConfig config_;
  std::uint64_t seed_;
  ConcealedPhysics physics_;
  Scenario scenario_;
  Random error_;  // of the positions that it reaches

  double epoch_s_ = 0.0;
  std::array<double, 2> initial_{};
  std::vector<GimbalMove> moves_;  // as commanded, since the epoch
  GimbalMotion motion_;            // as they are made
  std::unique_ptr<ImuSimulator> imu_;
  std::uint64_t samples_ = 0;
  ImuSample before_;
};

}  // namespace selfcal::sim
