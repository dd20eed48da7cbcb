#include "estimator/diagnosis/poses/pose_headings.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "estimator/diagnosis/poses/pose_earth.hpp"
#include "estimator/diagnosis/poses/pose_student.hpp"
#include "estimator/diagnosis/poses/pose_turns.hpp"
#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

struct Fit {
  Vector3 bias = Vector3::Zero();
  Matrix3 information = Matrix3::Zero();  // of the bias, for residuals of unit variance
  double square = HUGE_VAL;               // that is left
};

// By the vertical part alone, which is linear in the bias.
Vector3 bias_by_vertical(const std::vector<Pose>& poses, double up) {
  Matrix3 N = Matrix3::Zero();
  Vector3 right = Vector3::Zero();
  for (const Pose& p : poses) {
    const Vector3 u = p.u.normalized();
    N += u * u.transpose();
    right += u * (u.dot(p.gyro) - up);
  }
  return N.ldlt().solve(right);
}

Fit fit_bias(const std::vector<Pose>& poses, double up, double level) {
  Fit fit;
  fit.bias = bias_by_vertical(poses, up);
  constexpr int rounds = 15;
  for (int round = 0; round < rounds; ++round) {
    fit.information.setZero();
    fit.square = 0.0;
    Vector3 right = Vector3::Zero();
    for (const Pose& p : poses) {
      const Vector3 u = p.u.normalized(), r = p.gyro - fit.bias;
      const Vector3 horizontal = r - u * u.dot(r);
      const double size = horizontal.norm();
      const Vector3 along = size > 0.0 ? Vector3(horizontal / size) : Vector3::Zero();
      const double off_up = u.dot(r) - up, off_level = size - level;
      fit.information += u * u.transpose() + along * along.transpose();
      right += u * off_up + along * off_level;
      fit.square += off_up * off_up + off_level * off_level;
    }
    fit.bias += fit.information.ldlt().solve(right);
  }
  return fit;
}

bool directions_span(const std::vector<Pose>& poses) {
  Matrix3 N = Matrix3::Zero();
  for (const Pose& p : poses) {
    N += p.u.normalized() * p.u.normalized().transpose();
  }
  constexpr double least = 0.5;  // two poses with an axis within half a right angle of the vertical
  return Eigen::SelfAdjointEigenSolver<Matrix3>(N).eigenvalues().minCoeff() > least;
}

std::string another_latitude(double told, double seen) {
  std::array<char, 240> text{};
  std::snprintf(
      text.data(), text.size(),
      "the gyros see the Earth turn as at latitude %.0f deg, and %.1f deg is told: gravity, and with it scale factors "
      "of "
      "the accelerometers, are those of the place that is told",
      seen / units::degree, told / units::degree);
  return text.data();
}

}  // namespace

std::optional<FreeHeadings> bias_by_free_headings(const PoseInput& input, const std::vector<Pose>& poses) {
  constexpr std::size_t enough = 6;
  if (input.sensors != Sensors::both || !knows_gyro_unit(input) || poses.size() < enough || !directions_span(poses)) {
    return std::nullopt;
  }
  const double omega = earth::omega_ie_n(0.0).norm() / input.gyro_unit;
  const auto at_latitude = [&](double latitude) {
    return fit_bias(poses, omega * std::sin(latitude), omega * std::cos(latitude));
  };
  constexpr int tenths = 900;
  constexpr double step = 0.1 * units::degree;
  std::vector<double> left;
  double best = 0.0, square = HUGE_VAL;
  std::array<double, 2> of_hemisphere = {HUGE_VAL, HUGE_VAL};
  for (int k = -tenths; k <= tenths; ++k) {
    left.push_back(at_latitude(k * step).square);
    double& hemisphere = of_hemisphere.at(k < 0 ? 1 : 0);
    hemisphere = std::min(hemisphere, left.back());
    if (left.back() < square) {
      square = left.back();
      best = k * step;
    }
  }
  const double free = 2.0 * static_cast<double>(poses.size()) - 4.0;  // two of three readings; biases and latitude
  const auto likelier = [free](double than, double with) {
    return 0.5 * free * std::log(than / std::max(1e-300, with));
  };
  constexpr double sure = 6.0, contradicts = 8.0, most = 0.1;
  FreeHeadings found;
  found.latitude = input.latitude.value_or(best);
  Fit fit = at_latitude(found.latitude);
  if (!input.latitude) {
    if (likelier(std::max(of_hemisphere[0], of_hemisphere[1]), square) < sure) {
      return std::nullopt;
    }
    double weights = 0.0, spread = 0.0;
    for (int k = -tenths; k <= tenths; ++k) {
      const double weight = std::exp(-likelier(left[static_cast<std::size_t>(k + tenths)], square));
      weights += weight;
      spread += weight * std::pow(k * step - best, 2);
    }
    found.latitude_sigma = std::sqrt(spread / weights + step * step / 12.0);
  } else if (const Fit other = at_latitude(-found.latitude); likelier(fit.square, other.square) > sure) {
    found.reversed = true;  // told below as what it may be as well
    fit = other;
  }
  if (input.latitude && likelier(fit.square, square) > contradicts) {
    found.seen = best;
    found.reversed = false;
    fit = at_latitude(best);
  }
  const double freedom = free + (input.latitude ? 1.0 : 0.0);
  const double noise = std::sqrt(fit.square / freedom);
  if (noise > most * omega) {
    return std::nullopt;
  }
  found.bias = fit.bias;
  found.noise = noise;
  found.sigma = fit.information.inverse().diagonal().cwiseSqrt() * noise * student_widening(freedom);
  return found;
}

std::vector<Pose> without_earth(const PoseInput& input, const std::vector<Pose>& poses,
                                const std::vector<std::size_t>& usable, PoseDiagnosis& d) {
  const bool carried = usable.size() + 1 == poses.size();
  const EarthInPoses earth = earth_in_poses(input, poses, carried);
  d.earth_taken_out = earth.heading;
  d.latitude_seen = earth.latitude;
  d.latitude_seen_sigma = earth.latitude_sigma;
  d.accel_reversed = earth.reversed;
  if (input.latitude && earth.latitude) {
    d.gyros_contradict = another_latitude(*input.latitude, *earth.latitude);
  }
  std::vector<Pose> still = poses;
  for (std::size_t k = 0; k < still.size(); ++k) {
    still[k].gyro -= earth.rate[k];
  }
  return still;
}

bool judge_free_headings(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns,
                         PoseDiagnosis& d) {
  const auto found = turns.empty() ? bias_by_free_headings(input, poses) : std::nullopt;
  if (!found) {
    return false;
  }
  d.earth_taken_out = true;
  d.accel_reversed = found->reversed;
  if (!input.latitude) {
    d.latitude_seen = found->latitude;
    d.latitude_seen_sigma = found->latitude_sigma;
  }
  if (found->seen) {
    d.gyros_contradict = another_latitude(*input.latitude, *found->seen);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    d.gyro_bias[axis] = found->bias(static_cast<Eigen::Index>(axis));
    d.gyro_bias_sigma[axis] = found->sigma(static_cast<Eigen::Index>(axis));
    d.gyro_held_out_rms[axis] = found->noise;
  }
  d.invisible.emplace_back(
      "what goes with the pose or the time in the gyros: no turn carries the heading from pose to pose, and the "
      "Earth's "
      "rate takes one in each");
  return true;
}

void add_bias_by_headings(const PoseInput& input, std::vector<Pose> poses, PoseDiagnosis& d) {
  for (Pose& p : poses) {
    p.u = p.accel.normalized();  // a hundredth of g off is a hundredth of the Earth's rate
  }
  const EarthInPoses earth = earth_in_poses(input, poses, usable_turns(input, poses, d).size() + 1 == poses.size());
  if (!earth.heading) {
    return;
  }
  d.earth_taken_out = true;
  d.accel_reversed = earth.reversed;
  const auto n = static_cast<double>(poses.size());
  Vector3 sum = Vector3::Zero(), square = Vector3::Zero();
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector3 bias = poses[k].gyro - earth.rate[k];
    sum += bias;
    square += bias.cwiseAbs2();
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double variance = std::max(0.0, square(axis) / n - std::pow(sum(axis) / n, 2)) * n / (n - 1.0);
    d.gyro_bias.at(static_cast<std::size_t>(axis)) = sum(axis) / n;
    d.gyro_bias_sigma.at(static_cast<std::size_t>(axis)) = std::sqrt(variance / n);
  }
}

}  // namespace selfcal::diagnosis
