// The 24-parameter sensor model (tools/handbook/frames-and-signs.md) on increments: its exact inverse, and its derivatives.
#pragma once

#include <Eigen/Core>

#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal {

using ParameterVector = Eigen::Matrix<double, sensor_parameter_count, 1>;  // SI, order of sensor_parameters
using ParameterMatrix = Eigen::Matrix<double, sensor_parameter_count, sensor_parameter_count>;

// Takes the sensor errors out of measured increments. The accelerometer part is triangular and piecewise linear, the
// gyro part linear, so the inverse is exact: apply(error(x)) == x to rounding while f keeps its sign in the interval.
class SensorCompensation {
 public:
  explicit SensorCompensation(const ParameterVector& parameters);

  // Integrals over an interval of `dt` s in b: rad and m/s, measured -> true.
  Vector3 angle(const Vector3& measured, double dt) const { return gyro_inverse_ * (measured - dt * drift_); }
  Vector3 velocity(const Vector3& measured, double dt) const {
    const double x = scaled(0, measured.x() - dt * bias_.x());
    const double y = scaled(1, measured.y() - dt * bias_.y() - yx_ * x);
    const double z = scaled(2, measured.z() - dt * bias_.z() - zx_ * x - zy_ * y);
    return {x, y, z};
  }

 private:
  double scaled(int axis, double value) const { return value * (value >= 0.0 ? positive_(axis) : negative_(axis)); }

  Vector3 bias_, drift_;
  Vector3 positive_, negative_;  // 1/(1 + K+), 1/(1 - K-)
  double yx_, zx_, zy_;
  Matrix3 gyro_inverse_;  // (I + K_G + G)^-1
};

// What the derivatives need of a stretch of time in which b hardly turns: integrals in b over it.
struct SensorIntegrals {
  double dt = 0.0;                         // s, positive
  Vector3 angle = Vector3::Zero();         // rad
  Vector3 velocity_pos = Vector3::Zero();  // of max(f, 0), m/s
  Vector3 velocity_neg = Vector3::Zero();  // of max(-f, 0), m/s
};

inline constexpr int accel_parameter_count = 12;
inline constexpr int gyro_parameter_count = 12;
// Table indices of the columns of the two matrices below.
extern const std::array<int, accel_parameter_count> accel_parameter_index;
extern const std::array<int, gyro_parameter_count> gyro_parameter_index;
using AccelSensitivity = Eigen::Matrix<double, 3, accel_parameter_count>;
using GyroSensitivity = Eigen::Matrix<double, 3, gyro_parameter_count>;

// d(integral of C_nb df)/d(parameters), and d(integral of C_nb dw)/d(parameters).
void add_accel_sensitivity(const Matrix3& C_nb, const SensorIntegrals& s, double weight, AccelSensitivity& sum);
void add_gyro_sensitivity(const Matrix3& C_nb, const SensorIntegrals& s, double weight, GyroSensitivity& sum);

}  // namespace selfcal
