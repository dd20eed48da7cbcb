#include "estimator/models/sensor_model.hpp"

#include <Eigen/LU>
#include <array>

namespace selfcal {

const std::array<int, accel_parameter_count> accel_parameter_index = {
    parameter::accel_bias,         parameter::accel_bias + 1,         parameter::accel_bias + 2,
    parameter::accel_scale_pos,    parameter::accel_scale_pos + 1,    parameter::accel_scale_pos + 2,
    parameter::accel_scale_neg,    parameter::accel_scale_neg + 1,    parameter::accel_scale_neg + 2,
    parameter::accel_misalignment, parameter::accel_misalignment + 1, parameter::accel_misalignment + 2};

const std::array<int, gyro_parameter_count> gyro_parameter_index = {parameter::gyro_drift,
                                                                    parameter::gyro_drift + 1,
                                                                    parameter::gyro_drift + 2,
                                                                    parameter::gyro_scale,
                                                                    parameter::gyro_scale + 1,
                                                                    parameter::gyro_scale + 2,
                                                                    parameter::gyro_misalignment,
                                                                    parameter::gyro_misalignment + 1,
                                                                    parameter::gyro_misalignment + 2,
                                                                    parameter::gyro_misalignment + 3,
                                                                    parameter::gyro_misalignment + 4,
                                                                    parameter::gyro_misalignment + 5};

SensorCompensation::SensorCompensation(const ParameterVector& p)
    : bias_(p.segment<3>(parameter::accel_bias)),
      drift_(p.segment<3>(parameter::gyro_drift)),
      positive_((1.0 + p.segment<3>(parameter::accel_scale_pos).array()).inverse()),
      negative_((1.0 - p.segment<3>(parameter::accel_scale_neg).array()).inverse()),
      yx_(p(parameter::accel_misalignment)),
      zx_(p(parameter::accel_misalignment + 1)),
      zy_(p(parameter::accel_misalignment + 2)) {
  const auto K = p.segment<3>(parameter::gyro_scale);
  const auto G = p.segment<6>(parameter::gyro_misalignment);
  Matrix3 M;
  M << 1.0 + K(0), G(0), G(1), G(2), 1.0 + K(1), G(3), G(4), G(5), 1.0 + K(2);
  gyro_inverse_ = M.inverse();
}

void add_accel_sensitivity(const Matrix3& C_nb, const SensorIntegrals& s, double weight, AccelSensitivity& sum) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 column = weight * C_nb.col(axis);
    sum.col(axis) += s.dt * column;
    sum.col(3 + axis) += s.velocity_pos(axis) * column;
    sum.col(6 + axis) += s.velocity_neg(axis) * column;
  }
  const Vector3 velocity = s.velocity_pos - s.velocity_neg;
  sum.col(9) += weight * velocity.x() * C_nb.col(1);
  sum.col(10) += weight * velocity.x() * C_nb.col(2);
  sum.col(11) += weight * velocity.y() * C_nb.col(2);
}

void add_gyro_sensitivity(const Matrix3& C_nb, const SensorIntegrals& s, double weight, GyroSensitivity& sum) {
  const Vector3 angle = weight * s.angle;
  for (int axis = 0; axis < 3; ++axis) {
    sum.col(axis) += weight * s.dt * C_nb.col(axis);
    sum.col(3 + axis) += angle(axis) * C_nb.col(axis);
  }
  sum.col(6) += angle.y() * C_nb.col(0);
  sum.col(7) += angle.z() * C_nb.col(0);
  sum.col(8) += angle.x() * C_nb.col(1);
  sum.col(9) += angle.z() * C_nb.col(1);
  sum.col(10) += angle.x() * C_nb.col(2);
  sum.col(11) += angle.y() * C_nb.col(2);
}

}  // namespace selfcal
