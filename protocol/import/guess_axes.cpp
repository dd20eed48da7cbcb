#include "protocol/import/guess_axes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/geometry/earth.hpp"

namespace selfcal::import {
namespace {

constexpr double nearly_as_well = 0.02;  // of the sum of squares: what calibration errors of 10 % and a wobble leave

Matrix3 gimbal_of(const std::array<double, 2>& read_out, bool swapped) {
  return gimbal_matrix(read_out[swapped ? 1 : 0], read_out[swapped ? 0 : 1]);
}

// Rotation of b, in b, for a small or single-axis turn of the gimbal.
Vector3 turn_in_b(double inner, double outer_by, double inner_by) {
  return Vector3(0.0, inner_by, 0.0) + outer_by * (rotation_y(inner).transpose() * Vector3::UnitZ());
}

// One rotation's result; the best is kept, and those that are nearly as good.
class Contest {
 public:
  void enter(const Matrix3& rotation, double explained, double scale) {
    entries_.push_back({rotation, explained});
    if (entries_.size() == 1 || explained > best_.explained + 1e-12) {
      best_.explained = explained;
      best_.rotation = rotation;
      best_.sign = scale < 0.0 ? -1.0 : 1.0;
      best_.scale = std::abs(scale);
    }
  }
  AxisFit end(std::size_t seen) {
    best_.seen = seen;
    for (const auto& [rotation, explained] : entries_) {
      if (explained > best_.explained - nearly_as_well && rotation != best_.rotation) {
        best_.alike.push_back(rotation);
      }
    }
    return best_;
  }

 private:
  std::vector<std::pair<Matrix3, double>> entries_;
  AxisFit best_;
};

// Without the largest fifth: a turn that clips, or goes on for minutes, says nothing.
double sum_of_most(std::vector<double> values) {
  constexpr double kept = 0.8;
  std::sort(values.begin(), values.end());
  values.resize(static_cast<std::size_t>(std::ceil(kept * static_cast<double>(values.size()))));
  return std::accumulate(values.begin(), values.end(), 0.0);
}

struct Pair {
  Vector3 file;  // gyros
  Vector3 true_turn;
};

// Scalar least squares of true = s R file for each of the 24 rotations.
std::optional<AxisFit> best_rotation(const std::vector<Pair>& pairs) {
  double total = 0.0;
  double power = 0.0;
  Matrix3 moment = Matrix3::Zero();
  for (const Pair& pair : pairs) {
    total += pair.true_turn.squaredNorm();
    power += pair.file.squaredNorm();
    moment += pair.true_turn * pair.file.transpose();
  }
  if (!(total > 0.0) || !(power > 0.0)) {
    return std::nullopt;
  }
  Contest contest;
  for (const Matrix3& rotation : axis_rotations()) {
    const double scale = rotation.cwiseProduct(moment).sum() / power;
    contest.enter(rotation, scale * scale * power / total, scale);
  }
  return contest.end(pairs.size());
}

}  // namespace

bool AxisFit::fits(const Matrix3& other) const {
  return rotation == other || std::find(alike.begin(), alike.end(), other) != alike.end();
}

const std::vector<Matrix3>& axis_rotations() {
  static const std::vector<Matrix3> all = [] {
    std::vector<Matrix3> found;
    std::array<int, 3> order{0, 1, 2};
    do {
      for (int signs = 0; signs < 8; ++signs) {
        Matrix3 m = Matrix3::Zero();
        for (int k = 0; k < 3; ++k) {
          m(k, order[static_cast<std::size_t>(k)]) = (signs >> k & 1) != 0 ? -1.0 : 1.0;
        }
        if (m.determinant() > 0.0) {
          found.push_back(m);
        }
      }
    } while (std::next_permutation(order.begin(), order.end()));
    // The identity first: where several fit alike, it is the one that is kept.
    std::stable_partition(found.begin(), found.end(), [](const Matrix3& m) { return m.trace() == 3.0; });
    return found;
  }();
  return all;
}

std::optional<AxisFit> gyros_by_gimbal(const Motion& motion, const std::vector<Turn>& turns, bool swapped) {
  std::vector<Pair> pairs;
  const std::size_t o = swapped ? 1 : 0;
  const std::size_t i = swapped ? 0 : 1;
  constexpr double least_turn = 0.1;  // rad
  for (const Turn& turn : turns) {
    const double larger = std::max(std::abs(turn.by[o]), std::abs(turn.by[i]));
    const double smaller = std::min(std::abs(turn.by[o]), std::abs(turn.by[i]));
    if (larger > least_turn && smaller < 0.02 * larger) {
      pairs.push_back({turn.gyro, turn_in_b(turn.from[i], turn.by[o], turn.by[i])});
    }
  }
  constexpr std::size_t fewest = 3;
  if (pairs.size() < fewest) {
    // Both axes at once, or never at rest: block by block.
    pairs.clear();
    for (const Block& block : motion.blocks) {
      const double outer_by = block.to[o] - block.from[o];
      const double inner_by = block.to[i] - block.from[i];
      if (std::hypot(outer_by, inner_by) > 1e-4) {
        pairs.push_back({block.gyro - static_cast<double>(motion.samples) * motion.bias,
                         turn_in_b(0.5 * (block.from[i] + block.to[i]), outer_by, inner_by)});
      }
    }
  }
  return pairs.size() < fewest ? std::nullopt : best_rotation(pairs);
}

std::optional<AxisFit> accelerometers_by_gimbal(const std::vector<Rest>& rests, bool swapped) {
  std::vector<std::pair<Matrix3, Vector3>> seen;
  for (const Rest& rest : rests) {
    const double size = rest.accel.norm();
    if (size > 0.0) {
      seen.emplace_back(gimbal_of(rest.gimbal, swapped), rest.accel / size);
    }
  }
  constexpr std::size_t fewest = 3;
  if (seen.size() < fewest) {
    return std::nullopt;
  }
  Contest contest;
  for (const Matrix3& rotation : axis_rotations()) {
    Vector3 sum = Vector3::Zero();
    for (const auto& [C_vb, f] : seen) {
      sum += C_vb * (rotation * f);
    }
    contest.enter(rotation, sum.squaredNorm() / std::pow(static_cast<double>(seen.size()), 2), 1.0);
  }
  return contest.end(seen.size());
}

std::optional<AxisFit> gyros_by_gravity(const Motion& motion) {
  // df = -s (R theta) x f = s f x (R theta), linear in s for each R.
  struct Step {
    Vector3 theta, f, df;
  };
  std::vector<Step> steps;
  const auto samples = static_cast<double>(motion.samples);
  for (std::size_t k = 0; k + 1 < motion.blocks.size(); ++k) {
    const Block& a = motion.blocks[k];
    const Block& b = motion.blocks[k + 1];
    const Vector3 f = 0.5 * (a.accel + b.accel);
    const Vector3 df = b.accel - a.accel;
    constexpr double small_angle = 0.5;  // the midpoint is 2 % off there
    if ((!a.quiet || !b.quiet) && df.norm() < small_angle * f.norm()) {
      steps.push_back({0.5 * (a.gyro + b.gyro) - samples * motion.bias, f, df});
    }
  }
  constexpr std::size_t fewest = 8;
  if (steps.size() < fewest) {
    return std::nullopt;
  }
  double total = 0.0;
  for (const Step& step : steps) {
    total += step.df.squaredNorm();
  }
  Contest contest;
  for (const Matrix3& rotation : axis_rotations()) {
    double product = 0.0;
    double power = 0.0;
    for (const Step& step : steps) {
      const Vector3 predicted = step.f.cross(rotation * step.theta);
      product += predicted.dot(step.df);
      power += predicted.squaredNorm();
    }
    const double scale = power > 0.0 ? product / power : 0.0;
    contest.enter(rotation, total > 0.0 ? scale * product / total : 0.0, scale);
  }
  return contest.end(steps.size());
}

std::optional<AxisFit> gyros_from_rest_to_rest(const TriadColumns& gyro, const Motion& motion,
                                               const std::vector<Rest>& rests, double scale) {
  constexpr std::size_t fewest = 4;
  if (rests.size() < fewest + 1) {
    return std::nullopt;
  }
  std::vector<double> change;
  for (std::size_t k = 1; k < rests.size(); ++k) {
    change.push_back((rests[k].accel - rests[k - 1].accel).squaredNorm());
  }
  const double total = sum_of_most(change);
  Contest contest;
  std::vector<AxisFit> best_of(axis_rotations().size());
  constexpr int factors = 29;  // from a half to two, 5 % apart
  for (int step = 0; step < factors; ++step) {
    const double factor = 0.5 * std::pow(1.05, step);
    for (const double sign : {1.0, -1.0}) {
      // Of a turned instrument the rotation turns with it: R exp(theta) R^T.
      std::vector<Matrix3> turned;
      for (std::size_t k = 1; k < rests.size(); ++k) {
        const Vector3 bias = 0.5 * (rests[k - 1].gyro + rests[k].gyro);
        Eigen::Quaterniond C = Eigen::Quaterniond::Identity();
        const std::size_t end = motion.blocks[rests[k].first + 1].row;
        for (std::size_t row = motion.blocks[rests[k - 1].last - 1].row; row < end; ++row) {
          C = C * quaternion_from_rotation_vector(sign * factor * scale * (gyro.at(row) - bias));
        }
        turned.push_back(C.normalized().toRotationMatrix());
      }
      for (std::size_t r = 0; r < axis_rotations().size(); ++r) {
        const Matrix3& rotation = axis_rotations()[r];
        std::vector<double> left;
        for (std::size_t k = 1; k < rests.size(); ++k) {
          const Vector3 predicted =
              rotation * (turned[k - 1].transpose() * (rotation.transpose() * rests[k - 1].accel));
          left.push_back((rests[k].accel - predicted).squaredNorm());
        }
        const double explained = 1.0 - sum_of_most(left) / total;
        if (best_of[r].scale == 0.0 || explained > best_of[r].explained) {
          best_of[r].explained = explained;
          best_of[r].scale = sign * factor * scale;
        }
      }
    }
  }
  for (std::size_t r = 0; r < best_of.size(); ++r) {
    contest.enter(axis_rotations()[r], best_of[r].explained, best_of[r].scale);
  }
  return contest.end(rests.size() - 1);
}

std::optional<EarthRate> earth_rate(const std::vector<Rest>& rests, const Matrix3& gyro_axes, double rad_per_count_s,
                                    const Matrix3& accel_axes, bool has_gimbal, bool swapped) {
  // With a gimbal: w = C_bv omega_v + b, six unknowns from three equations a rest. Without: w . u = Omega sin L + b . u.
  const auto unknowns = has_gimbal ? 6 : 4;
  const auto per_rest = has_gimbal ? 3 : 1;
  const auto rows = static_cast<Eigen::Index>(rests.size()) * per_rest;
  if (rows < unknowns + 2) {
    return std::nullopt;
  }
  Eigen::MatrixXd A(rows, unknowns);
  Eigen::VectorXd y(rows);
  Vector3 f_v = Vector3::Zero();
  for (std::size_t k = 0; k < rests.size(); ++k) {
    const Vector3 w = gyro_axes * rests[k].gyro * rad_per_count_s;
    const Vector3 u = (accel_axes * rests[k].accel).normalized();
    const auto row = static_cast<Eigen::Index>(k) * per_rest;
    if (has_gimbal) {
      const Matrix3 C_vb = gimbal_of(rests[k].gimbal, swapped);
      A.block<3, 3>(row, 0) = C_vb.transpose();
      A.block<3, 3>(row, 3) = Matrix3::Identity();
      y.segment<3>(row) = w;
      f_v += C_vb * u;
    } else {
      A(row, 0) = 1.0;
      A.block<1, 3>(row, 1) = u.transpose();
      y(row) = w.dot(u);
    }
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
  if (qr.rank() < unknowns) {
    return std::nullopt;
  }
  const Eigen::VectorXd x = qr.solve(y);
  const double variance = (y - A * x).squaredNorm() / static_cast<double>(rows - unknowns);
  const Eigen::MatrixXd covariance = (A.transpose() * A).inverse() * variance;
  EarthRate found;
  if (has_gimbal) {
    const Vector3 up = f_v.normalized();
    found.sine_of_latitude = x.head<3>().dot(up) / earth::rotation_rate;
    found.sigma = std::sqrt(up.dot(covariance.topLeftCorner<3, 3>() * up)) / earth::rotation_rate;
  } else {
    found.sine_of_latitude = x(0) / earth::rotation_rate;
    found.sigma = std::sqrt(covariance(0, 0)) / earth::rotation_rate;
  }
  return found;
}

}  // namespace selfcal::import
