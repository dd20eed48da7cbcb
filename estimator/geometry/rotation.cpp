#include "estimator/geometry/rotation.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal {

Matrix3 skew(const Vector3& a) {
  Matrix3 S;
  S << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return S;
}

Matrix3 rotation_x(double angle) { return Eigen::AngleAxisd(angle, Vector3::UnitX()).toRotationMatrix(); }
Matrix3 rotation_y(double angle) { return Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix(); }
Matrix3 rotation_z(double angle) { return Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix(); }

Eigen::Quaterniond quaternion_from_rotation_vector(const Vector3& phi) {
  const double h2 = 0.25 * phi.squaredNorm();  // (|phi|/2)^2
  double cosine = 0.0;
  double half_sinc = 0.0;  // sin(|phi|/2) / |phi|
  if (h2 < 1e-4) {         // first term left out: h2^4/40320 < 1e-20
    cosine = 1.0 - 0.5 * h2 * (1.0 - 1.0 / 12.0 * h2 * (1.0 - 1.0 / 30.0 * h2));
    half_sinc = 0.5 * (1.0 - 1.0 / 6.0 * h2 * (1.0 - 1.0 / 20.0 * h2 * (1.0 - 1.0 / 42.0 * h2)));
  } else {
    const double h = std::sqrt(h2);
    cosine = std::cos(h);
    half_sinc = 0.5 * std::sin(h) / h;
  }
  return {cosine, half_sinc * phi.x(), half_sinc * phi.y(), half_sinc * phi.z()};
}

Matrix3 matrix_from_rotation_vector(const Vector3& phi) {
  return quaternion_from_rotation_vector(phi).toRotationMatrix();
}

Vector3 rotation_vector_from_matrix(const Matrix3& C) {
  Eigen::Quaterniond q(C);
  if (q.w() < 0.0) {
    q.coeffs() *= -1.0;
  }
  const double sine = q.vec().norm();
  // 2 atan2(s, c) / s -> 2 / c as s -> 0; c is then 1 to s^2/2.
  const double factor = sine < 1e-8 ? 2.0 : 2.0 * std::atan2(sine, q.w()) / sine;
  return factor * q.vec();
}

Matrix3 attitude_matrix(const Attitude& attitude) {
  return rotation_y(-attitude.heading) * rotation_z(attitude.pitch) * rotation_x(attitude.roll);
}

Attitude attitude_from_matrix(const Matrix3& C) {
  // C = Ry(-psi) Rz(theta) Rx(gamma), written out:
  //   [ cos psi cos theta,  ...,                   ...                   ]
  //   [ sin theta,          cos theta cos gamma,   -cos theta sin gamma  ]
  //   [ sin psi cos theta,  ...,                   ...                   ]
  Attitude attitude;
  const double cos_pitch = std::hypot(C(1, 1), C(1, 2));
  attitude.pitch = std::atan2(C(1, 0), cos_pitch);
  if (cos_pitch > 1e-9) {
    attitude.roll = std::atan2(-C(1, 2), C(1, 1));
    attitude.heading = std::atan2(C(2, 0), C(0, 0));
  } else {  // only heading -+ roll is defined: roll := 0, so the third column is Ry(-psi) e_z
    attitude.heading = std::atan2(-C(0, 2), C(2, 2));
  }
  return attitude;
}

Matrix3 gimbal_matrix(double outer, double inner) { return rotation_z(outer) * rotation_y(inner); }

}  // namespace selfcal
