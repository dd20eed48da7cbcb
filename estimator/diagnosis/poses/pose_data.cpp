#include "estimator/diagnosis/poses/pose_data.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

Vector3 at(const std::vector<std::array<double, 3>>& series, std::size_t i) {
  return Eigen::Map<const Vector3>(series[i].data());
}

// Scatter of windows of `window` samples: root of the sum of the axes' variances.
std::vector<double> scatter(const std::vector<std::array<double, 3>>& series, std::size_t window) {
  std::vector<double> result;
  const Vector3 offset = at(series, 0);  // raw counts are large beside their scatter
  Vector3 sum = Vector3::Zero(), square = Vector3::Zero();
  for (std::size_t i = 0; i < series.size(); ++i) {
    const Vector3 in = at(series, i) - offset;
    sum += in;
    square += in.cwiseAbs2();
    if (i + 1 >= window) {
      const auto n = static_cast<double>(window);
      result.push_back(std::sqrt(std::max(0.0, (square / n - (sum / n).cwiseAbs2()).sum())));
      const Vector3 out = at(series, i + 1 - window) - offset;
      sum -= out;
      square -= out.cwiseAbs2();
    }
  }
  return result;
}

double quiet_level(std::vector<double> values) {
  const auto tenth = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 20);
  std::nth_element(values.begin(), tenth, values.end());
  return *tenth;
}

Pose mean_of(const PoseInput& input, std::size_t first, std::size_t last) {
  Pose p;
  p.first = first;
  p.last = last;
  p.middle_s = 0.5 * (input.time_s[first] + input.time_s[last - 1]) - input.time_s.front();
  p.gyro = p.accel = Vector3::Zero();
  for (std::size_t i = first; i < last; ++i) {
    p.gyro += at(input.gyro, i);
    p.accel += at(input.accel, i);
  }
  const auto n = static_cast<double>(last - first);
  p.gyro /= n;
  p.accel /= n;
  Vector3 square = Vector3::Zero();
  for (std::size_t i = first + 1; i < last; ++i) {
    square += (at(input.gyro, i) - at(input.gyro, i - 1)).cwiseAbs2();
  }
  p.gyro_white = (0.5 * square / (n - 1.0) / n).cwiseSqrt();
  return p;
}

}  // namespace

std::vector<Pose> find_poses(const PoseInput& input) {
  std::vector<Pose> poses;
  const double rate = static_cast<double>(input.time_s.size() - 1) / (input.time_s.back() - input.time_s.front());
  const auto window = static_cast<std::size_t>(std::lround(rate));  // 1 s
  if (window < 4 || input.time_s.size() < 20 * window) {
    return poses;
  }
  const std::vector<double> gyro = scatter(input.gyro, window), accel = scatter(input.accel, window);
  constexpr double factor = 3.0;
  const double gyro_limit = factor * quiet_level(gyro), accel_limit = factor * quiet_level(accel);
  std::size_t begin = 0;
  bool inside = false;
  for (std::size_t k = 0; k <= gyro.size(); ++k) {
    const bool quiet = k < gyro.size() && gyro[k] < gyro_limit && accel[k] < accel_limit;
    if (quiet && !inside) {
      begin = k;
    } else if (!quiet && inside && k - begin >= window) {
      poses.push_back(mean_of(input, begin + window / 2, k + window / 2));  // middles of the windows
    }
    inside = quiet;
  }
  return poses;
}

AccelModel fit_accelerometers(const std::vector<Pose>& poses) {
  AccelModel m;
  Vector3 low = poses.front().accel, high = low;
  for (const Pose& p : poses) {
    low = low.cwiseMin(p.accel);
    high = high.cwiseMax(p.accel);
  }
  m.bias = 0.5 * (low + high);
  m.T.diagonal() = 2.0 * (high - low).cwiseInverse();
  const auto n = static_cast<Eigen::Index>(poses.size());
  m.residual.resize(n);
  m.jacobian.resize(n, 9);
  constexpr std::array<std::pair<int, int>, 6> free = {{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
  for (int round = 0; round < 20; ++round) {
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vector3 d = poses[static_cast<std::size_t>(k)].accel - m.bias;
      const Vector3 u = m.T * d;
      const Vector3 e = u.normalized();
      m.residual(k) = u.norm() - 1.0;
      m.jacobian.block<1, 3>(k, 0) = -(e.transpose() * m.T);
      for (std::size_t j = 0; j < free.size(); ++j) {
        m.jacobian(k, 3 + static_cast<Eigen::Index>(j)) = e(free[j].first) * d(free[j].second);
      }
    }
    const Eigen::VectorXd step = m.jacobian.colPivHouseholderQr().solve(-m.residual);
    m.bias += step.head<3>();
    for (std::size_t j = 0; j < free.size(); ++j) {
      m.T(free[j].first, free[j].second) += step(3 + static_cast<Eigen::Index>(j));
    }
  }
  return m;
}

Vector3 direction_error(const PoseInput& input, const Pose& from, const Pose& to, const GyroModel& model) {
  Vector3 u = from.u.normalized();
  for (std::size_t i = from.last; i < to.first; ++i) {
    const double dt = input.time_s[i] - input.time_s[i - 1];
    const Vector3 raw = at(input.gyro, i) - model.bias - model.G * u;
    u = matrix_from_rotation_vector(-(model.S * raw) * input.gyro_unit * dt) * u;
  }
  return u - to.u.normalized();
}

void fit_turns(const PoseInput& input, const std::vector<Pose>& poses, std::size_t without, GyroModel& model) {
  const auto turns = poses.size() - 1;
  for (int round = 0; round < 3; ++round) {
    Eigen::MatrixXd J(3 * static_cast<Eigen::Index>(turns), 9);
    Eigen::VectorXd r(J.rows());
    J.setZero();
    r.setZero();
    for (std::size_t k = 0; k < turns; ++k) {
      if (k == without) {
        continue;
      }
      const auto row = 3 * static_cast<Eigen::Index>(k);
      const Vector3 now = direction_error(input, poses[k], poses[k + 1], model);
      r.segment<3>(row) = now;
      constexpr double h = 1e-4;
      for (Eigen::Index j = 0; j < 9; ++j) {
        GyroModel moved = model;
        moved.S(j / 3, j % 3) += h;
        J.block<3, 1>(row, j) = (direction_error(input, poses[k], poses[k + 1], moved) - now) / h;
      }
    }
    const Eigen::Matrix<double, 9, 1> step = J.colPivHouseholderQr().solve(-r);
    for (Eigen::Index j = 0; j < 9; ++j) {
      model.S(j / 3, j % 3) += step(j);
    }
    if (step.cwiseAbs().maxCoeff() < 1e-5) {
      break;
    }
  }
}

}  // namespace selfcal::diagnosis
