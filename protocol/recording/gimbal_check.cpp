#include "protocol/recording/gimbal_check.hpp"

#include <algorithm>
#include <array>
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

// What sensors that are not calibrated, on a base that sways, may differ by.
double tolerance_of(std::vector<double> disagreements) {
  const auto quartile = disagreements.begin() + static_cast<std::ptrdiff_t>(disagreements.size() / 4);
  std::nth_element(disagreements.begin(), quartile, disagreements.end());
  return std::min(max_tolerance_deg, base_tolerance_deg + quiet_factor * *quartile);
}

Eigen::Quaterniond read_out_at(const Recording& recording, std::size_t row) {
  return Eigen::Quaterniond(gimbal_matrix(recording.gimbal_outer_rad[row], recording.gimbal_inner_rad[row]));
}

bool stands(const Recording& recording, std::size_t first, std::size_t last) {
  constexpr double still = 1e-3;  // rad
  const auto stays = [&](const std::vector<double>& angle) {
    const auto from = angle.begin() + static_cast<std::ptrdiff_t>(first);
    const auto [low, high] = std::minmax_element(from, angle.begin() + static_cast<std::ptrdiff_t>(last) + 1);
    return *high - *low < still;
  };
  return stays(recording.gimbal_outer_rad) && stays(recording.gimbal_inner_rad);
}

// rad a row: the usual window in which the read-outs stand. Zero where these are few.
Vector3 drift_at_rest(const Recording& recording, std::size_t window) {
  constexpr std::size_t enough = 4;
  std::array<std::vector<double>, 3> means;
  for (std::size_t row = 0; row + window < recording.size(); row += window / 2) {
    if (stands(recording, row, row + window)) {
      Vector3 sum = Vector3::Zero();
      for (std::size_t k = row + 1; k <= row + window; ++k) {
        sum += Vector3(recording.delta_theta_rad[k].data());
      }
      for (std::size_t axis = 0; axis < means.size(); ++axis) {
        means[axis].push_back(sum(static_cast<Eigen::Index>(axis)) / static_cast<double>(window));
      }
    }
  }
  Vector3 drift = Vector3::Zero();
  for (std::size_t axis = 0; axis < means.size() && means[axis].size() >= enough; ++axis) {
    const auto middle = means[axis].begin() + static_cast<std::ptrdiff_t>(means[axis].size() / 2);
    std::nth_element(means[axis].begin(), middle, means[axis].end());
    drift(static_cast<Eigen::Index>(axis)) = *middle;
  }
  return drift;
}

struct Window {
  std::size_t first = 0, last = 0;
  Eigen::Quaterniond by_gyros;
};

// Whether the read-outs, as much as they may lag, go round in it.
bool goes_round(const Recording& recording, const Window& w, std::size_t beside) {
  double path = 0.0;
  const std::size_t last = std::min(recording.size() - 1, w.last + beside);
  for (std::size_t row = w.first > beside ? w.first - beside : 0; row < last; ++row) {
    path += std::abs(recording.gimbal_outer_rad[row + 1] - recording.gimbal_outer_rad[row]) +
            std::abs(recording.gimbal_inner_rad[row + 1] - recording.gimbal_inner_rad[row]);
  }
  return path > 2.0 * M_PI;
}

// Without those in which gyros and read-outs turn by half a round and more.
std::vector<Window> comparable_windows(const Recording& recording) {
  const auto half = static_cast<std::size_t>(std::max(1.0, half_window_s * recording.sample_rate_hz));
  const Vector3 drift = drift_at_rest(recording, 2 * half);
  std::vector<Window> windows;
  for (std::size_t row = 0; row + 2 * half < recording.size(); row += half) {
    Window w{row, row + 2 * half, Eigen::Quaterniond::Identity()};
    double path = 0.0;
    for (std::size_t k = w.first + 1; k <= w.last; ++k) {
      const Vector3 turn = Vector3(recording.delta_theta_rad[k].data()) - drift;
      path += turn.norm();
      w.by_gyros = w.by_gyros * quaternion_from_rotation_vector(turn);
    }
    w.by_gyros.normalize();
    if (path < M_PI || !goes_round(recording, w, half)) {
      windows.push_back(w);
    }
  }
  return windows;
}

std::vector<double> disagreements_with(const Recording& recording, const std::vector<Window>& windows, double lag_s,
                                       double growth_s) {
  const auto rows = static_cast<double>(recording.size());
  std::vector<double> all;
  for (const Window& w : windows) {
    const double shift = (lag_s + growth_s * static_cast<double>(w.first) / rows) * recording.sample_rate_hz;
    const auto shifted = [&](std::size_t row) {
      return static_cast<std::size_t>(std::clamp(std::round(static_cast<double>(row) + shift), 0.0, rows - 1.0));
    };
    const Eigen::Quaterniond by_gimbal =
        read_out_at(recording, shifted(w.first)).conjugate() * read_out_at(recording, shifted(w.last));
    all.push_back(angle_deg(by_gimbal.conjugate() * w.by_gyros));
  }
  return all;
}

}  // namespace

std::optional<GimbalContradiction> find_gimbal_contradiction(const Recording& recording) {
  const auto half = static_cast<std::size_t>(std::max(1.0, half_window_s * recording.sample_rate_hz));
  // Row r holds the read-out at the end of interval r: rows (r0, r1] of the gyros turn read-out r0 into r1.
  std::vector<Eigen::Quaterniond> turns;
  for (std::size_t row = 0; row + half < recording.size(); row += half) {
    turns.push_back(integrated_rotation(recording, row + 1, row + half + 1));
  }
  const auto C_vb = [&](std::size_t row) { return read_out_at(recording, row); };
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
  const double tolerance = tolerance_of(disagreements);
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

bool lags_alone(const Recording& recording) {
  constexpr double step_s = 0.05;
  constexpr int most_lag = 30, most_growth = 10;  // 1.5 s; 1 s, in two steps each
  const std::vector<Window> windows = comparable_windows(recording);
  if (windows.empty()) {
    return true;
  }
  for (int growth = -most_growth; growth <= most_growth; ++growth) {
    for (int lag = -most_lag; lag <= most_lag; ++lag) {
      const std::vector<double> all = disagreements_with(recording, windows, lag * step_s, growth * 2.0 * step_s);
      if (*std::max_element(all.begin(), all.end()) <= tolerance_of(all)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace selfcal
