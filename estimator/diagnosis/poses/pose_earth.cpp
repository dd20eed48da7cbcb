#include "estimator/diagnosis/poses/pose_earth.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Logarithm of the odds of what leaves the square `with` against what leaves `than`, of n poses.
double likelier(double than, double with, std::size_t n) {
  const double free = 3.0 * static_cast<double>(n - 1);
  return 0.5 * free * std::log(than / std::max(1e-300, with));
}

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

// A gyro that reads one value in all poses hides the Earth's rate, with whatever else is there.
std::array<bool, 3> silent_axes(const std::vector<Pose>& poses) {
  std::array<bool, 3> silent{};
  for (std::size_t axis = 0; axis < silent.size(); ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    silent[axis] = std::all_of(poses.begin(), poses.end(), [&](const Pose& p) {
      return p.gyro(i) == poses.front().gyro(i) && p.gyro_white(i) == 0.0;
    });
  }
  return silent;
}

// Less what a bias and a coefficient of the temperature make; 0 of gyros that say nothing.
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
  const std::array<bool, 3> silent = silent_axes(poses);
  for (std::size_t axis = 0; axis < silent.size(); ++axis) {
    if (silent[axis]) {
      all.col(static_cast<Eigen::Index>(axis)).setZero();
    }
  }
  return all;
}

// Heading of the greatest likelihood, biases and coefficients of the temperature free; the squares that it and no horizontal rate leave.
struct Heading {
  double angle = 0.0, with = HUGE_VAL, without = 0.0;
};
Heading find_heading(const std::vector<Pose>& poses, const std::vector<Vector3>& reading,
                     const std::vector<Vector3>& first, const std::vector<Vector3>& second, double rate,
                     int steps = 3600) {
  const Eigen::MatrixX3d y = projected(reading, poses), a = projected(first, poses), b = projected(second, poses);
  Heading best;
  best.without = y.squaredNorm();
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

// Where nobody says the latitude the Earth still turns at 15.04 deg/h: the likeliest latitude and heading, where they are likelier than no Earth
// by e^8 and than the other hemisphere by e^6. A vertical part that is the same in all poses stands with the bias. `left_square`: what it leaves.
EarthInPoses earth_of_any_latitude(const PoseInput& input, const std::vector<Pose>& poses, double& left_square) {
  EarthInPoses earth;
  earth.rate.assign(poses.size(), Vector3::Zero());
  const std::vector<Vector3> first = carried_direction(input, poses);
  std::vector<Vector3> second, plain;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    second.emplace_back(poses[k].u.normalized().cross(first[k]));
    plain.push_back(poses[k].gyro);
  }
  const double omega = earth::omega_ie_n(0.0).norm() / input.gyro_unit;
  Heading best;
  double latitude = 0.0;
  std::array<double, 2> of_hemisphere = {HUGE_VAL, HUGE_VAL};
  std::vector<std::pair<double, double>> tried;  // angle, square that is left
  const auto try_at = [&](double angle) {
    constexpr int headings = 360;
    std::vector<Vector3> reading = plain;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      reading[i] -= omega * std::sin(angle) * poses[i].u.normalized();
    }
    const Heading found = find_heading(poses, reading, first, second, omega * std::cos(angle), headings);
    tried.emplace_back(angle, found.with);
    double& hemisphere = of_hemisphere.at(angle < 0.0 ? 1 : 0);
    hemisphere = std::min(hemisphere, found.with);
    if (found.with < best.with) {
      best = found;
      latitude = angle;
    }
  };
  constexpr int degrees = 90, apart = 2, tenths = 20;
  for (int k = -degrees; k <= degrees; k += apart) {
    try_at(k * units::degree);
  }
  const double coarse = latitude;
  const std::vector<std::pair<double, double>> all = tried;
  for (int k = -tenths; k <= tenths; ++k) {
    try_at(coarse + 0.1 * k * units::degree);
  }
  constexpr double than_none = 8.0, than_other = 6.0;
  earth.heading = likelier(projected(plain, poses).squaredNorm(), best.with, poses.size()) > than_none &&
                  likelier(std::max(of_hemisphere[0], of_hemisphere[1]), best.with, poses.size()) > than_other;
  left_square = best.with;
  if (!earth.heading) {
    return earth;
  }
  earth.latitude = latitude;
  // By the likelihood over the grid, whose step is no finer than this.
  double weights = 0.0, square = 0.0;
  for (const auto& [angle, left] : all) {
    const double weight = std::exp(-likelier(left, best.with, poses.size()));
    weights += weight;
    square += weight * (angle - latitude) * (angle - latitude);
  }
  constexpr double step = apart * units::degree;
  earth.latitude_sigma = std::sqrt(square / weights + step * step / 12.0);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector3 level = std::cos(best.angle) * first[k] + std::sin(best.angle) * second[k];
    earth.rate[k] = omega * (std::sin(latitude) * poses[k].u.normalized() + std::cos(latitude) * level);
  }
  return earth;
}

// Where neither latitude nor heading is known the vertical part is: it stands along u in all three axes alike. It is taken where it is likelier
// than none by e^6 and no more than the Earth's rate and its sigma. An isotropic g-sensitivity of that size does the same, and no pose parts them.
EarthInPoses vertical_part(const PoseInput& input, const std::vector<Pose>& poses) {
  EarthInPoses earth;
  earth.rate.assign(poses.size(), Vector3::Zero());
  constexpr std::size_t enough = 6;
  if (poses.size() < enough) {
    return earth;
  }
  std::vector<Vector3> up, reading;
  for (const Pose& p : poses) {
    up.emplace_back(p.u.normalized());
    reading.push_back(p.gyro);
  }
  const Eigen::MatrixX3d y = projected(reading, poses), a = projected(up, poses);
  const double square = a.squaredNorm();
  if (!(square > 0.1 * static_cast<double>(poses.size()))) {
    return earth;  // hardly turned over: it stands with the bias
  }
  const double omega = earth::omega_ie_n(0.0).norm() / input.gyro_unit;
  const double rate = a.cwiseProduct(y).sum() / square, left = (y - rate * a).squaredNorm();
  const double free = 3.0 * static_cast<double>(poses.size() - 1);
  const double sigma = std::sqrt(left / (free - 1.0) / square);
  // Of three sigma and more a g-sensitivity that widens sigma would have its part.
  constexpr double than_none = 6.0;
  if (likelier(y.squaredNorm(), left, poses.size()) < than_none || std::abs(rate) - sigma > omega) {
    return earth;
  }
  const auto latitude_of = [omega](double vertical) { return std::asin(std::clamp(vertical / omega, -1.0, 1.0)); };
  const double vertical = std::clamp(rate, -omega, omega);
  earth.latitude = latitude_of(vertical);
  earth.latitude_sigma =
      std::max(latitude_of(vertical + sigma) - *earth.latitude, *earth.latitude - latitude_of(vertical - sigma));
  for (std::size_t k = 0; k < poses.size(); ++k) {
    earth.rate[k] = vertical * up[k];
  }
  return earth;
}

EarthInPoses earth_in_room(const PoseInput& input, const std::vector<Pose>& poses, bool carried) {
  EarthInPoses earth;
  earth.rate.assign(poses.size(), Vector3::Zero());
  if (input.sensors != Sensors::both || !knows_gyro_unit(input)) {
    return earth;
  }
  constexpr std::size_t enough = 4;  // 3 biases and a heading of 12 readings
  if (!input.latitude) {
    double left = HUGE_VAL;
    earth = carried && poses.size() > enough ? earth_of_any_latitude(input, poses, left) : earth;
    return earth.heading ? earth : vertical_part(input, poses);
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
  if (!carried || poses.size() < enough) {
    take(omega_n.y());
    return earth;
  }
  const std::vector<Vector3> first = carried_direction(input, poses);
  std::vector<Vector3> second;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    second.emplace_back(poses[k].u.normalized().cross(first[k]));
  }
  const auto shows = [&poses](double without, double with) {
    constexpr double than_without = 6.0;
    return likelier(without, with, poses.size()) > than_without;
  };
  Heading found = find_heading(poses, less_vertical(omega_n.y()), first, second, omega_n.x());
  const Heading other = find_heading(poses, less_vertical(-omega_n.y()), first, second, omega_n.x());
  earth.reversed = shows(found.with, other.with);
  found = earth.reversed ? other : found;
  if (poses.size() > enough) {
    double left = HUGE_VAL;
    EarthInPoses any = earth_of_any_latitude(input, poses, left);
    constexpr double contradicts = 8.0;
    constexpr double sigmas = 5.0;
    const bool elsewhere = any.latitude && std::abs(*any.latitude - *input.latitude) > sigmas * any.latitude_sigma;
    if (elsewhere && likelier(found.with, left, poses.size()) > contradicts) {
      return any;
    }
  }
  earth.heading = shows(found.without, found.with);
  take(earth.reversed ? -omega_n.y() : omega_n.y());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    earth.rate[k] += omega_n.x() * (std::cos(found.angle) * first[k] + std::sin(found.angle) * second[k]);
  }
  return earth;
}

}  // namespace

EarthInPoses earth_in_poses(const PoseInput& input, const std::vector<Pose>& poses, bool carried) {
  EarthInPoses earth = earth_in_room(input, poses, carried);
  const std::array<bool, 3> silent = silent_axes(poses);
  for (Vector3& rate : earth.rate) {
    for (std::size_t axis = 0; axis < silent.size(); ++axis) {
      rate(static_cast<Eigen::Index>(axis)) *= silent[axis] ? 0.0 : 1.0;
    }
  }
  return earth;
}

// The Earth's rate is fixed in the room, and a sensor that is turned by hand sees it go with the pose: within 15.04 deg/h and its sigma.
void mark_earth(const PoseInput& input, PoseDiagnosis& d) {
  if (d.earth_taken_out || !knows_gyro_unit(input)) {
    return;
  }
  const double omega = earth::omega_ie_n(0.0).norm() / input.gyro_unit;
  constexpr double sure = 3.0;
  for (PoseEffect& e : d.gyro_named) {
    bool within = e.effect->linear_in_force;
    for (std::size_t k = 0; k < e.value.size(); ++k) {
      within = within && std::abs(e.value[k]) - sure * e.sigma[k] < omega;
    }
    e.may_be_earth = within;
  }
}

}  // namespace selfcal::diagnosis
