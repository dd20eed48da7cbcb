// Rotations. Matrices are named C_<to><from>: v_to = C_tofrom * v_from, so adjacent letters cancel.
// Frames (tools/handbook/frames-and-signs.md): n = north, up, east; v = vehicle (forward, up, right); b = IMU.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace selfcal {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

// [a x]: skew(a) * b == a.cross(b).
Matrix3 skew(const Vector3& a);

// Elementary right-handed rotations: the columns are the turned axes, angle in rad.
Matrix3 rotation_x(double angle);
Matrix3 rotation_y(double angle);
Matrix3 rotation_z(double angle);

// exp([phi x]), exact for every angle, with its Taylor series near zero (error < 1e-16).
Eigen::Quaterniond quaternion_from_rotation_vector(const Vector3& phi);
Matrix3 matrix_from_rotation_vector(const Vector3& phi);
// The inverse, |result| <= pi.
Vector3 rotation_vector_from_matrix(const Matrix3& C);

// Attitude of the vehicle: rad; roll about x (forward), pitch about z (right, nose up positive), heading clockwise
// from north.
struct Attitude {
  double roll = 0.0;
  double pitch = 0.0;
  double heading = 0.0;
};

// C_nv = Ry(-heading) Rz(pitch) Rx(roll).
Matrix3 attitude_matrix(const Attitude& attitude);
// Inverse of attitude_matrix; at pitch = +-90 deg, where roll and heading act about the same axis, roll is 0.
Attitude attitude_from_matrix(const Matrix3& C_nv);
// C_vb = Rz(outer) Ry(inner), gimbal angles in rad.
Matrix3 gimbal_matrix(double outer, double inner);

}  // namespace selfcal
