#include "estimator/diagnosis/noise/base_tilt.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

// Means over 10 s of a column that is not there.
struct Means {
  Eigen::Matrix3Xd force, angle;  // m/s^2; rad, of the gyros' integral
};

Means means_of(const ImuData& data, const Segment& s) {
  constexpr double block_s = 10.0;
  const auto block = static_cast<std::size_t>(block_s * data.sample_rate_hz);
  const auto n = static_cast<Eigen::Index>((s.last - s.first) / block);
  Means means{Eigen::Matrix3Xd::Zero(3, n), Eigen::Matrix3Xd::Zero(3, n)};
  Vector3 angle = Vector3::Zero();
  for (Eigen::Index k = 0; k < n; ++k) {
    for (std::size_t i = 0; i < block; ++i) {
      const std::size_t at = s.first + static_cast<std::size_t>(k) * block + i;
      angle += Vector3(data.delta_theta[at].data());
      means.angle.col(k) += angle / static_cast<double>(block);
      means.force.col(k) += Vector3(data.delta_v[at].data()) * data.sample_rate_hz / static_cast<double>(block);
    }
  }
  return means;
}

Eigen::VectorXd less_line(const Eigen::VectorXd& y) {
  const Eigen::VectorXd time = Eigen::VectorXd::LinSpaced(y.size(), -1.0, 1.0);
  return (y.array() - y.mean()).matrix() - time * (time.dot(y) / time.squaredNorm());
}

std::optional<BaseTilt> about(const Means& means, const Vector3& axis, const Vector3& up, double g) {
  // A turn by a small angle about a changes f by -a x f.
  const Eigen::VectorXd by_gravity = means.force.transpose() * up.cross(axis) / g;
  const Eigen::VectorXd gravity = less_line(by_gravity), gyros = less_line(means.angle.transpose() * axis);
  constexpr double alike = 0.9, most_apart = 0.25;
  BaseTilt tilt;
  tilt.range = by_gravity.maxCoeff() - by_gravity.minCoeff();
  tilt.correlation = gravity.dot(gyros) / std::max(1e-300, gravity.norm() * gyros.norm());
  tilt.apart = (gravity - gyros).norm() / std::sqrt(static_cast<double>(gravity.size()));
  const bool agree = tilt.correlation > alike && (gravity - gyros).norm() < most_apart * gravity.norm();
  return agree ? std::optional(tilt) : std::nullopt;
}

}  // namespace

std::optional<BaseTilt> base_tilt(const ImuData& data, const std::vector<Segment>& segments) {
  if (std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.rotation; }) || segments.empty()) {
    return std::nullopt;
  }
  const Segment& longest = *std::max_element(segments.begin(), segments.end(), [](const Segment& a, const Segment& b) {
    return a.last - a.first < b.last - b.first;
  });
  const Means means = means_of(data, longest);
  constexpr Eigen::Index enough = 12;
  if (means.force.cols() < enough) {
    return std::nullopt;
  }
  const Vector3 force = means.force.rowwise().mean(), up = force.normalized();
  Eigen::Index least = 0;
  up.cwiseAbs().minCoeff(&least);
  const Vector3 first = up.cross(Vector3::Unit(least)).normalized(), second = up.cross(first);
  std::optional<BaseTilt> larger;
  for (const Vector3& axis : {first, second}) {
    const std::optional<BaseTilt> tilt = about(means, axis, up, force.norm());
    if (tilt && (!larger || tilt->range > larger->range)) {
      larger = tilt;
    }
  }
  return larger;
}

}  // namespace selfcal::diagnosis
