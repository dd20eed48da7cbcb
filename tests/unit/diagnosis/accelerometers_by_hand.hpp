// Accelerometers and gyros that a hand puts down in random poses, with whatever the accelerometers read too much.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal::test {

constexpr int rest = 400, move = 200;  // samples of 10 ms
const Vector3 bias(0.03, -0.02, 0.01);
constexpr double gravity = 9.81, mg = 1e-3 * gravity;

// `share` of the log that has passed and the direction of gravity to what the accelerometers read too much, m/s^2.
template <typename Extra>
diagnosis::PoseInput hand_turned(int pose_count, std::uint32_t seed, Extra extra) {
  constexpr double dt = 0.01, gyro_noise = 1e-3, force_noise = 5e-3;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&]() { return Vector3(normal(random), normal(random), normal(random)); };
  diagnosis::PoseInput input;
  input.accel_unit = 1.0;
  input.gravity = gravity;
  Vector3 u(0.0, 0.0, 1.0);
  const auto sample = [&](const Vector3& rate) {
    u = matrix_from_rotation_vector(-rate * dt) * u;
    const auto count = static_cast<double>(input.time_s.size());
    const Vector3 gyro = rate + gyro_noise * draw();
    const Vector3 force =
        gravity * u + bias + extra(count / static_cast<double>(pose_count * (rest + move)), u) + force_noise * draw();
    input.time_s.push_back(dt * count);
    input.gyro.push_back({gyro.x(), gyro.y(), gyro.z()});
    input.accel.push_back({force.x(), force.y(), force.z()});
  };
  for (int pose = 0; pose < pose_count; ++pose) {
    for (int k = 0; k < rest; ++k) {
      sample(Vector3::Zero());
    }
    const Vector3 axis = draw().normalized();
    for (int k = 0; k < move; ++k) {
      sample(axis * 0.9 * (1.0 - std::cos(2.0 * M_PI * (k + 0.5) / move)));
    }
  }
  return input;
}

}  // namespace selfcal::test
