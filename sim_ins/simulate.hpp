// What the virtual INS would record: gimbal, base, IMU, sensor errors and, if asked, concealed physics, as one
// recording made at once. The process `sim_ins` produces the same samples one after another (imu_simulator.hpp).
#pragma once

#include <cstdint>
#include <string>

#include "estimator/geometry/schedule.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/physics.hpp"

namespace selfcal::sim {

// Writes one complete recording. Same configuration, schedule, seed and physics: the same bits.
// Fails with bad_input where a value is outside its range or a move is beyond the gimbal's rate or acceleration.
[[nodiscard]] Expected<Recording> simulate(const SimConfig& config, const Schedule& schedule, std::uint64_t seed,
                                           const ConcealedPhysics& physics);

// The errors that simulate() gives its sensors for this configuration and seed. Fails on an unknown parameter_set.
[[nodiscard]] Expected<SensorErrors> true_sensor_errors(const SimConfig& config, std::uint64_t seed);

// Writes what only a judge may read: the 24 errors, attitude, seed, concealed physics, as JSON.
[[nodiscard]] Expected<void> write_truth(const std::string& path, const SimConfig& config, std::uint64_t seed,
                                         const ConcealedPhysics& physics);

}  // namespace selfcal::sim
