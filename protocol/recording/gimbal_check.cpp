#include "protocol/recording/gimbal_check.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

constexpr double half_window_s = 2.0;
constexpr double base_tolerance_deg = 2.0;
constexpr double quiet_factor = 6.0;
constexpr double max_tolerance_deg = 20.0;

// Rotation of b over rows [first, last), the product of the samples' rotation vectors. Coning within a sample is
// below 1e-3 deg here.
Eigen::Quaterniond integrated_rotation(const Recording& recording, std::size_t first, std::size_t last) {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  for (std::size_t row = first; row < last; ++row) {
    const auto& d = recording.delta_theta_rad[row];
    rotation = rotation * quaternion_from_rotation_vector({d[0], d[1], d[2]});
  }
  return rotation.normalized();
}

double angle_deg(const Eigen::Quaterniond& rotation) { return Eigen::AngleAxisd(rotation).angle() / units::degree; }

}  // namespace

std::optional<GimbalContradiction> find_gimbal_contradiction(const Recording& recording) {
  const auto half = static_cast<std::size_t>(std::max(1.0, half_window_s * recording.sample_rate_hz));
  // Row r holds the read-out at the end of interval r: rows (r0, r1] of the gyros turn read-out r0 into r1.
  std::vector<Eigen::Quaterniond> turns;
  for (std::size_t row = 0; row + half < recording.size(); row += half) {
    turns.push_back(integrated_rotation(recording, row + 1, row + half + 1));
  }
  const auto C_vb = [&](std::size_t row) {
    return Eigen::Quaterniond(gimbal_matrix(recording.gimbal_outer_rad[row], recording.gimbal_inner_rad[row]));
  };
  std::vector<double> disagreements;
  for (std::size_t k = 0; k + 1 < turns.size(); ++k) {
    const Eigen::Quaterniond by_gyro = turns[k] * turns[k + 1];
    const Eigen::Quaterniond by_gimbal = C_vb(k * half).conjugate() * C_vb((k + 2) * half);
    disagreements.push_back(angle_deg(by_gimbal.conjugate() * by_gyro));
  }
  if (disagreements.empty()) {
    return std::nullopt;
  }
  const auto worst = std::max_element(disagreements.begin(), disagreements.end());
  std::vector<double> sorted = disagreements;
  const auto quartile = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
  std::nth_element(sorted.begin(), quartile, sorted.end());
  const double tolerance = std::min(max_tolerance_deg, base_tolerance_deg + quiet_factor * *quartile);
  if (*worst <= tolerance) {
    return std::nullopt;
  }
  const auto k = static_cast<std::size_t>(worst - disagreements.begin());
  GimbalContradiction found;
  found.first_row = k * half;
  found.last_row = (k + 2) * half;
  // Read-outs may be kept within one turn: from 359.7 to 0.4 deg the gimbal turned by 0.7. No gimbal makes half a turn
  // in a window.
  const auto turn = [&](const std::vector<double>& angle) {
    return std::remainder((angle[found.last_row] - angle[found.first_row]) / units::degree, 360.0);
  };
  found.outer_turn_deg = turn(recording.gimbal_outer_rad);
  found.inner_turn_deg = turn(recording.gimbal_inner_rad);
  found.gyro_turn_deg = angle_deg(turns[k] * turns[k + 1]);
  found.disagreement_deg = *worst;
  found.tolerance_deg = tolerance;
  return found;
}

}  // namespace selfcal
