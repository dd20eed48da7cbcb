#include "estimator/diagnosis/data/witnesses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal::diagnosis {
namespace {

constexpr double margin_s = 1.0;
constexpr double shortest_rest_s = 4.0;

Vector3 angle_of(const ImuData& data, std::size_t i) { return Eigen::Map<const Vector3>(data.delta_theta[i].data()); }

GimbalAngles angles_at(const ImuData& data, std::size_t i) {
  return data.gimbal_outer.empty() ? GimbalAngles{} : GimbalAngles{data.gimbal_outer[i], data.gimbal_inner[i]};
}

// A rotation vector that is followed: of those of one attitude the one nearest to the vector before.
class FollowedRotation {
 public:
  void reach(const Eigen::Quaterniond& q) {
    constexpr double whole = 2.0 * std::numbers::pi;
    const Vector3 shortest = rotation_vector_from_matrix(q.normalized().toRotationMatrix());
    const double angle = shortest.norm();
    constexpr double no_axis = 1e-6;  // rad: back where it began, or not yet away
    const Vector3 axis = angle > no_axis ? Vector3(shortest / angle) : vector_.normalized();
    vector_ = shortest + whole * std::round(axis.dot(vector_ - shortest) / whole) * axis;
  }
  const Vector3& vector() const { return vector_; }

 private:
  Vector3 vector_ = Vector3::Zero();
};

// The increments of samples (first, last], their opposite, and the read-outs.
SensedTurn turn_of(const ImuData& data, std::size_t first, std::size_t last) {
  Eigen::Quaterniond plus = Eigen::Quaterniond::Identity(), minus = plus;
  FollowedRotation by_gyros, by_mirrored, by_gimbal;
  const auto gimbal_at = [&](std::size_t i) {
    const GimbalAngles angles = angles_at(data, i);
    return Eigen::Quaterniond(gimbal_matrix(angles.outer, angles.inner));
  };
  const Eigen::Quaterniond from = gimbal_at(first).conjugate();
  for (std::size_t i = first + 1; i <= last; ++i) {
    plus = plus * quaternion_from_rotation_vector(angle_of(data, i));
    minus = minus * quaternion_from_rotation_vector(-angle_of(data, i));
    by_gyros.reach(plus);
    by_mirrored.reach(minus);
    by_gimbal.reach(from * gimbal_at(i));
  }
  return {by_gyros.vector(), by_mirrored.vector(), by_gimbal.vector(), angles_at(data, first), angles_at(data, last)};
}

}  // namespace

Witnesses gather_witnesses(const ImuData& data, const std::vector<Segment>& segments, const Vector3& drift) {
  Witnesses w;
  w.gimbal = data.gimbal_outer.size() == data.size() && data.gimbal_inner.size() == data.size();
  const auto margin = static_cast<std::size_t>(margin_s * data.sample_rate_hz);
  const double dt = 1.0 / data.sample_rate_hz;
  Eigen::Quaterniond plus = Eigen::Quaterniond::Identity(), minus = plus;
  for (const Segment& s : segments) {
    if (s.rotation && s.first > 0 && s.last < data.size()) {
      const std::size_t before = s.first - 1 - std::min(s.first - 1, margin);
      w.turns.push_back(turn_of(data, before, std::min(s.last + margin, data.size() - 1)));
    }
    const std::size_t from = s.first + margin, to = s.last - std::min(s.last, margin), middle = (s.first + s.last) / 2;
    SensedRest rest;
    for (std::size_t i = s.first; i < s.last; ++i) {
      const Vector3 angle = angle_of(data, i);
      if (i == middle) {
        rest.C_ib = plus.toRotationMatrix();
        rest.C_ib_mirrored = minus.toRotationMatrix();
        rest.angles = angles_at(data, i);
      }
      if (i >= from && i < to) {
        rest.rate += angle;
        rest.force += Eigen::Map<const Vector3>(data.delta_v[i].data());
      }
      plus = (plus * quaternion_from_rotation_vector(angle - drift * dt)).normalized();
      minus = (minus * quaternion_from_rotation_vector(drift * dt - angle)).normalized();
    }
    if (!s.rotation && static_cast<double>(s.last - s.first) * dt > shortest_rest_s) {
      rest.length_s = static_cast<double>(to - from) * dt;
      rest.middle_s = static_cast<double>(middle) * dt;
      rest.rate /= rest.length_s;
      rest.force /= rest.length_s;
      w.rests.push_back(rest);
    }
  }
  return w;
}

}  // namespace selfcal::diagnosis
