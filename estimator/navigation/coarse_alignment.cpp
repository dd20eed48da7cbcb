#include "estimator/navigation/coarse_alignment.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <vector>

namespace selfcal {
namespace {

struct VelocityPoint {
  double time_s;
  Vector3 velocity;  // integral of the specific force, in b0
};

std::vector<VelocityPoint> inertial_velocity(const ImuData& data, double span_s) {
  std::vector<VelocityPoint> points;
  const double start = data.time_s[0] - 1.0 / data.sample_rate_hz;
  const auto step = static_cast<std::size_t>(std::max(1.0, std::round(0.1 * data.sample_rate_hz)));
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Vector3 velocity = Vector3::Zero();
  points.push_back({0.0, velocity});
  for (std::size_t i = 0; i < data.size() && data.time_s[i] - start <= span_s; ++i) {
    const Eigen::Map<const Vector3> angle(data.delta_theta[i].data());
    const Eigen::Map<const Vector3> gain(data.delta_v[i].data());
    velocity += q * (gain + 0.5 * angle.cross(gain));
    q = q * quaternion_from_rotation_vector(angle);
    q.normalize();
    if ((i + 1) % step == 0) {
      points.push_back({data.time_s[i] - start, velocity});
    }
  }
  return points;
}

}  // namespace

CoarseAlignment coarse_alignment(const ImuData& data, double span_s) {
  const std::vector<VelocityPoint> points = inertial_velocity(data, span_s);
  const double span = points.back().time_s;
  // v(t) = v0 + a t + b t^2/2, t in units of the span.
  Matrix3 normal = Matrix3::Zero();
  Matrix3 right = Matrix3::Zero();
  for (const VelocityPoint& point : points) {
    const double t = point.time_s / span;
    const double s = std::sin(std::numbers::pi * t);
    const double weight = s * s;
    const Vector3 basis(1.0, t, 0.5 * t * t);
    normal += weight * basis * basis.transpose();
    right += weight * basis * point.velocity.transpose();
  }
  const Matrix3 fit = normal.ldlt().solve(right);
  const Vector3 force = fit.row(1).transpose() / span;             // g u at t = 0
  const Vector3 turning = fit.row(2).transpose() / (span * span);  // g Omega cos L e

  CoarseAlignment result;
  result.span_s = span;
  result.gravity = force.norm();
  const Vector3 up = force.normalized();
  Vector3 east = turning - turning.dot(up) * up;
  result.horizontal_rate = east.norm() / result.gravity;
  if (east.norm() == 0.0) {
    east = up.unitOrthogonal();
  }
  east.normalize();
  result.C_nb.row(0) = up.cross(east).transpose();
  result.C_nb.row(1) = up.transpose();
  result.C_nb.row(2) = east.transpose();
  return result;
}

}  // namespace selfcal
