#include "tests/attitude/tracked_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace selfcal::attitude_trial {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double gravity = 9.80665;
constexpr double fine_s = 1e-3;

Vector3d normals(std::mt19937_64& random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  return {normal(random), normal(random), normal(random)};
}

Quaterniond turn_by(const Vector3d& phi) {
  const double angle = phi.norm();
  return angle > 0.0 ? Quaterniond(Eigen::AngleAxisd(angle, phi / angle)) : Quaterniond::Identity();
}

// Rate of b against r: between rests three lines of each axis, under a window that is zero with its slope at both ends.
struct Motion {
  std::vector<Vector3d> rate;     // every fine_s
  std::vector<Quaterniond> q_rb;  // there
};

Motion drawn_motion(const Course& course, std::mt19937_64& random) {
  std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI), frequency(0.05, 1.6), any(0.0, 1.0);
  Motion motion;
  const auto rest = static_cast<int>(std::lround(course.rest_s / fine_s));
  const auto move = static_cast<int>(std::lround(course.move_s / fine_s));
  for (int stop = 0; stop < course.stops; ++stop) {
    if (course.rests) {
      motion.rate.insert(motion.rate.end(), static_cast<std::size_t>(rest), Vector3d::Zero());
    }
    std::array<std::array<std::array<double, 3>, 3>, 3> lines{};
    for (auto& axis : lines) {
      for (auto& line : axis) {
        line = {0.5 + any(random), frequency(random), phase(random)};
      }
    }
    for (int k = 0; k < move; ++k) {
      const double s = static_cast<double>(k) / move, t = k * fine_s;
      const double window = course.rests ? std::pow(std::sin(M_PI * s), 2) : 1.0;
      Vector3d rate;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double sum = 0.0;
        for (const auto& line : lines.at(axis)) {
          sum += line[0] * std::sin(2.0 * M_PI * line[1] * t + line[2]);
        }
        rate(static_cast<Eigen::Index>(axis)) = 0.8 * window * sum;
      }
      motion.rate.emplace_back(rate.cwiseProduct(course.axes));
    }
  }
  motion.rate.insert(motion.rate.end(), static_cast<std::size_t>(rest), Vector3d::Zero());
  Quaterniond q = Quaterniond::Identity();
  for (std::size_t k = 0; k < motion.rate.size(); ++k) {
    motion.q_rb.push_back(q);
    const Vector3d mean = 0.5 * (motion.rate[k] + motion.rate[std::min(k + 1, motion.rate.size() - 1)]);
    q = (q * turn_by(fine_s * mean)).normalized();
  }
  return motion;
}

Quaterniond attitude_at(const Motion& motion, double time) {
  const double at = std::clamp(time / fine_s, 0.0, static_cast<double>(motion.q_rb.size() - 2));
  const auto k = static_cast<std::size_t>(at);
  return motion.q_rb[k].slerp(at - static_cast<double>(k), motion.q_rb[k + 1]);
}

}  // namespace

Truth drawn_truth(std::mt19937_64& random) {
  Truth truth;
  std::normal_distribution<double> normal;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      truth.M(i, j) += 0.008 * normal(random);
      truth.K(i, j) += i <= j ? 0.006 * normal(random) : 0.0;
    }
  }
  truth.C_bm = turn_by(normals(random, 1.0));
  truth.bias = normals(random, 0.007);
  truth.slope = normals(random, 2e-6);
  truth.accel_bias = normals(random, 0.2);
  truth.up = turn_by(normals(random, 0.02)) * Vector3d::UnitZ();
  truth.earth = 7.292115e-5 * (truth.up * std::sin(0.84) + truth.up.unitOrthogonal() * std::cos(0.84));
  truth.delay_s = 0.004 * normal(random);
  truth.drift = 30e-6 * normal(random);
  return truth;
}

TrackedLog drawn_log(const Truth& truth, const Course& course, std::mt19937_64& random) {
  const Motion motion = drawn_motion(course, random);
  TrackedLog log;
  diagnosis::PoseInput& input = log.input;
  input.accel_unit = 1.0;
  const double duration = static_cast<double>(motion.rate.size() - 1) * fine_s;
  const auto count = static_cast<int>(duration * course.rate_hz);
  const double middle = 0.5 * static_cast<double>(count + 1) / course.rate_hz;
  Vector3d walk = Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    const double t = (i + 1) / course.rate_hz;
    const Quaterniond q_rb = attitude_at(motion, t);
    const auto k = static_cast<std::size_t>(std::lround(t / fine_s));
    const Vector3d omega = motion.rate[std::min(k, motion.rate.size() - 1)] + q_rb.conjugate() * truth.earth;
    const Vector3d g = truth.M * omega + truth.bias + truth.slope * (t - middle) + walk +
                       normals(random, truth.gyro_asd * std::sqrt(course.rate_hz));
    const Vector3d f = truth.K * (q_rb.conjugate() * truth.up * gravity) + truth.accel_bias +
                       0.3 * motion.rate[std::min(k, motion.rate.size() - 1)] +
                       normals(random, truth.accel_asd * std::sqrt(course.rate_hz));
    log.mean_bias += (truth.bias + walk) / count;
    walk += normals(random, truth.walk_asd / std::sqrt(course.rate_hz));
    input.time_s.push_back(t);
    input.gyro.push_back({g.x(), g.y(), g.z()});
    input.accel.push_back({f.x(), f.y(), f.z()});
  }
  diagnosis::ReferenceAttitude attitude;
  diagnosis::AttitudeReading reading;
  reading.words = "as drawn";
  Vector3d error = normals(random, truth.attitude_sigma);
  const double fresh = std::sqrt(1.0 - truth.attitude_keeps * truth.attitude_keeps);
  for (int j = 0; j < static_cast<int>(duration * course.attitude_hz); ++j) {
    const double t = (j + 0.37) / course.attitude_hz;
    log.true_q_rm.push_back(attitude_at(motion, t) * truth.C_bm);
    error = truth.attitude_keeps * error + normals(random, fresh * truth.attitude_sigma);
    // A stamp s means the attitude of s - delay - drift (s - middle).
    attitude.time_s.push_back((t + truth.delay_s - truth.drift * middle) / (1.0 - truth.drift));
    reading.q_rm.push_back(turn_by(error) * log.true_q_rm.back());
  }
  attitude.readings.push_back(std::move(reading));
  input.attitude = std::move(attitude);
  return log;
}

}  // namespace selfcal::attitude_trial
