#include "estimator/diagnosis/poses/pose_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <span>

#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

// Variance of each axis among the means of blocks about that of all.
Vector3 variance_of(std::span<const Vector3> means) {
  Vector3 sum = Vector3::Zero(), square = Vector3::Zero();
  for (const Vector3& m : means) {
    sum += m - means.front();
    square += (m - means.front()).cwiseAbs2();
  }
  const auto n = static_cast<double>(means.size());
  return square / n - (sum / n).cwiseAbs2();
}

// Largest of an axis about the mean of so many blocks: what drifts for minutes does not move.
double variance_within(std::span<const Vector3> means, std::size_t blocks) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t first = 0; first < means.size(); first += blocks) {
    const std::span<const Vector3> these = means.subspan(first, std::min(blocks, means.size() - first));
    sum += static_cast<double>(these.size()) * variance_of(these);
  }
  return sum.maxCoeff() / static_cast<double>(means.size());
}

}  // namespace

bool moves(const PoseInput& input, const Pose& stretch) {
  constexpr double block_s = 0.25, most_rate = units::degree, most_force = 0.05;
  constexpr std::size_t blocks = 40;  // 10 s
  const auto length = std::max<std::size_t>(2, static_cast<std::size_t>(block_s * sample_rate(input)));
  std::vector<Vector3> gyro, accel;
  for (const auto& [first, last] : stretch.quiet) {
    for (std::size_t k = first; k + length <= last; k += length) {
      Vector3 g = Vector3::Zero(), a = Vector3::Zero();
      for (std::size_t i = k; i < k + length; ++i) {
        g += at(input.gyro, i) / static_cast<double>(length);
        a += at(input.accel, i) / static_cast<double>(length);
      }
      gyro.push_back(g);
      accel.push_back(a);
    }
  }
  if (gyro.size() < 2) {
    return false;
  }
  const bool turns = input.gyros_si && input.sensors != Sensors::accelerometers &&
                     variance_within(gyro, blocks) > most_rate * most_rate / (input.gyro_unit * input.gyro_unit);
  // Counts about a middle make the size larger than gravity's, and the limit with it.
  const double size = input.accel_unit > 0.0 ? input.gravity / input.accel_unit : stretch.accel.norm();
  return turns || (input.sensors != Sensors::gyros && variance_of(accel).maxCoeff() > std::pow(most_force * size, 2));
}

namespace {

constexpr double most_off = 0.3;  // g: 1.5 sigma of what a bias is before

double force_of(const PoseInput& input, const Pose& p) { return p.accel.norm() * input.accel_unit / input.gravity; }

}  // namespace

std::vector<double> forces_of_another_zero(const PoseInput& input, const std::vector<Pose>& stretches) {
  constexpr std::size_t least = 6;
  if (!(input.accel_unit > 0.0) || !input.gyros_si || input.sensors != Sensors::both || stretches.size() < least) {
    return {};
  }
  std::vector<double> forces(stretches.size());
  std::transform(stretches.begin(), stretches.end(), forces.begin(), [&](const Pose& p) { return force_of(input, p); });
  std::vector<Vector3> rates(stretches.size());
  std::transform(stretches.begin(), stretches.end(), rates.begin(), [](const Pose& p) { return p.gyro; });
  const Vector3 usual = median_of_axes(rates);
  const auto rests = static_cast<std::size_t>(std::count_if(stretches.begin(), stretches.end(), [&](const Pose& p) {
    return (p.gyro - usual).cwiseAbs().maxCoeff() * input.gyro_unit < units::degree;  // a centrifuge turns
  }));
  const auto others = static_cast<std::size_t>(
      std::count_if(forces.begin(), forces.end(), [](double f) { return std::abs(f - 1.0) > most_off; }));
  // Forces that are alike are gravity in another unit; about another zero they differ by up to 2 g.
  constexpr double alike = 1.3;
  const auto [least_force, most_force] = std::minmax_element(forces.begin(), forces.end());
  if (*most_force < alike * *least_force) {
    return {};
  }
  const bool elsewhere = 10 * rests >= 9 * stretches.size() && 3 * others >= stretches.size();
  return elsewhere ? forces : std::vector<double>{};
}

std::vector<double> drop_other_forces(const PoseInput& input, std::vector<Pose>& stretches) {
  std::vector<double> read;
  if (!(input.accel_unit > 0.0) || !input.accel_zero_known || input.sensors == Sensors::gyros) {
    return read;
  }
  std::erase_if(stretches, [&](const Pose& p) {
    const double force = force_of(input, p);
    const bool other = std::abs(force - 1.0) > most_off;
    if (other) {
      read.push_back(force);
    }
    return other;
  });
  return read;
}

std::vector<std::size_t> find_gaps(const PoseInput& input) {
  constexpr double least_s = 0.5, usual = 10.0;
  const double limit = std::max(least_s, usual / sample_rate(input));
  std::vector<std::size_t> gaps;
  for (std::size_t i = 1; i < input.time_s.size(); ++i) {
    if (input.time_s[i] - input.time_s[i - 1] > limit) {
      gaps.push_back(i);
    }
  }
  return gaps;
}

std::string lacks_gravity(const PoseInput& input, const std::vector<Pose>& poses, const AccelModel& model) {
  if (model.nominal) {
    return {};
  }
  // What is left of gravity by a phone's own calibration lies on an ellipsoid, and counts of one sensor's axes are of one kind.
  constexpr double most_unlike = 1.3;
  const Vector3 per_g = model.T.diagonal().cwiseInverse().cwiseAbs();
  if (per_g.maxCoeff() > most_unlike * per_g.minCoeff() && !model.held.any()) {
    return "the three accelerometers read 1 g as numbers that differ by more than 30 %: gravity is not what they read, "
           "as "
           "in a phone's linear acceleration";
  }
  std::vector<double> moving;
  std::size_t next = 0;
  for (std::size_t i = 0; i < input.time_s.size(); ++i) {
    while (next < poses.size() && i >= poses[next].last) {
      ++next;
    }
    if (next == poses.size() || i < poses[next].first) {
      moving.push_back(model.direction(at(input.accel, i)).norm());
    }
  }
  constexpr double share = 0.02, most = 2.5;  // a hand turns a sensor at 0.5 to 1.5 g, most of the time
  if (static_cast<double>(moving.size()) < share * static_cast<double>(input.time_s.size())) {
    return {};
  }
  const double times = median(moving);
  if (times < most) {
    return {};
  }
  std::array<char, 200> text{};
  std::snprintf(
      text.data(), text.size(),
      "the accelerometers read %.0f times as much while the sensor moves as at rest: gravity is not what they "
      "read, as in a phone's linear acceleration",
      times);
  return text.data();
}

std::string not_gravity(const PoseInput& input, const std::vector<Pose>& poses, const AccelModel& model) {
  constexpr double most = 0.03;  // of the mean, rms, beside bias, scale factor and misalignment
  double sum = 0.0, square = 0.0;
  for (const Pose& p : poses) {
    sum += p.u.norm();
    square += p.u.squaredNorm();
  }
  const auto n = static_cast<double>(poses.size());
  const double mean = sum / n, scatter = std::sqrt(std::max(0.0, square / n - mean * mean)) / mean;
  if (scatter < most) {
    return lacks_gravity(input, poses, model);
  }
  constexpr double percent = 100.0;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "at rest the accelerometers read forces that differ by %.0f %% rms beside bias, scale factor and "
                "misalignment: gravity is not what they read",
                percent * scatter);
  return text.data();
}

}  // namespace selfcal::diagnosis
