#include "estimator/diagnosis/poses/pose_earth.hpp"

#include <cmath>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// A horizontal direction in each pose, sensor axes: that of the first pose, carried by the gyros. What they read at rest is their
// bias, with the Earth's rate in it, so that nothing turns while the sensor stands.
std::vector<Vector3> carried_direction(const PoseInput& input, const std::vector<Pose>& poses) {
  std::vector<Vector3> all = {poses.front().u.unitOrthogonal()};
  for (std::size_t k = 1; k < poses.size(); ++k) {
    Vector3 direction = all.back();
    const Vector3 bias = 0.5 * (poses[k - 1].gyro + poses[k].gyro);
    for (std::size_t i = poses[k - 1].last; i < poses[k].first; ++i) {
      const double dt = input.time_s[i] - input.time_s[i - 1];
      direction = matrix_from_rotation_vector(-(at(input.gyro, i) - bias) * input.gyro_unit * dt) * direction;
    }
    const Vector3 up = poses[k].u.normalized();
    all.emplace_back((direction - up * up.dot(direction)).normalized());
  }
  return all;
}

// Less what a bias and a coefficient of the temperature make.
Eigen::MatrixX3d projected(const std::vector<Vector3>& rows, const std::vector<Pose>& poses) {
  Eigen::MatrixX3d all(static_cast<Eigen::Index>(rows.size()), 3);
  Eigen::VectorXd temperature(all.rows());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    all.row(static_cast<Eigen::Index>(k)) = rows[k].transpose();
    temperature(static_cast<Eigen::Index>(k)) = poses[k].temperature;
  }
  all.rowwise() -= all.colwise().mean().eval();
  temperature.array() -= temperature.mean();
  if (const double square = temperature.squaredNorm(); square > 0.0) {
    all -= temperature * (temperature.transpose() * all / square).eval();
  }
  return all;
}

// Heading of the greatest likelihood, biases and coefficients of the temperature free; the squares that it and no horizontal rate leave.
struct Heading {
  double angle = 0.0, with = HUGE_VAL, without = 0.0;
};
Heading find_heading(const std::vector<Pose>& poses, const std::vector<Vector3>& reading,
                     const std::vector<Vector3>& first, const std::vector<Vector3>& second, double rate) {
  const Eigen::MatrixX3d y = projected(reading, poses), a = projected(first, poses), b = projected(second, poses);
  Heading best;
  best.without = y.squaredNorm();
  constexpr int steps = 3600;
  for (int k = 0; k < steps; ++k) {
    const double angle = 2.0 * M_PI * k / steps;
    const double square = (y - rate * (std::cos(angle) * a + std::sin(angle) * b)).squaredNorm();
    if (square < best.with) {
      best.angle = angle;
      best.with = square;
    }
  }
  return best;
}

}  // namespace

EarthInPoses earth_in_poses(const PoseInput& input, const std::vector<Pose>& poses, bool carried) {
  EarthInPoses earth;
  earth.rate.assign(poses.size(), Vector3::Zero());
  if (!input.latitude || input.sensors != Sensors::both) {
    return earth;
  }
  const Vector3 omega_n = earth::omega_ie_n(*input.latitude) / input.gyro_unit;  // north, up, east
  const auto less_vertical = [&](double up) {
    std::vector<Vector3> reading;
    reading.reserve(poses.size());
    for (const Pose& p : poses) {
      reading.emplace_back(p.gyro - up * p.u.normalized());
    }
    return reading;
  };
  const auto take = [&](double up) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      earth.rate[k] = up * poses[k].u.normalized();
    }
  };
  constexpr std::size_t enough = 4;  // 3 biases and a heading of 12 readings
  if (!carried || poses.size() < enough) {
    take(omega_n.y());
    return earth;
  }
  const std::vector<Vector3> first = carried_direction(input, poses);
  std::vector<Vector3> second;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    second.emplace_back(poses[k].u.normalized().cross(first[k]));
  }
  const double free = 3.0 * static_cast<double>(poses.size() - 1);
  constexpr double likelier = 6.0;
  const auto shows = [free](double without, double with) {
    return 0.5 * free * std::log(without / std::max(1e-300, with)) > likelier;
  };
  Heading found = find_heading(poses, less_vertical(omega_n.y()), first, second, omega_n.x());
  const Heading other = find_heading(poses, less_vertical(-omega_n.y()), first, second, omega_n.x());
  earth.reversed = shows(found.with, other.with);
  found = earth.reversed ? other : found;
  earth.heading = shows(found.without, found.with);
  take(earth.reversed ? -omega_n.y() : omega_n.y());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    earth.rate[k] += omega_n.x() * (std::cos(found.angle) * first[k] + std::sin(found.angle) * second[k]);
  }
  return earth;
}

}  // namespace selfcal::diagnosis
