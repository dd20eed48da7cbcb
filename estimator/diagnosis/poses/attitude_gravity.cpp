#include "estimator/diagnosis/poses/attitude_gravity.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

struct Stand {
  Matrix3 C_mr = Matrix3::Identity();
  Vector3 force;
};

// The attitude's mean while a pose stands; nullopt: none.
std::optional<Matrix3> mean_attitude(const Knots& knots, const AttitudeFit& gyros, double first_s, double last_s) {
  Vector3 sum = Vector3::Zero();
  double count = 0.0;
  Eigen::Quaterniond base = Eigen::Quaterniond::Identity();
  for (std::size_t r = 0; r < gyros.rows.size(); ++r) {
    const std::size_t k = gyros.rows[r].knot;
    const double time = gyros.model.true_time(knots.all[k].time_s);
    if (time < first_s || time > last_s || !gyros.used[r]) {
      continue;
    }
    base = count == 0.0 ? gyros.q_rm[k] : base;
    sum += rotation_vector(base.conjugate() * gyros.q_rm[k]);
    count += 1.0;
  }
  return count == 0.0
             ? std::nullopt
             : std::optional<Matrix3>((base * quaternion_from_rotation_vector(sum / count)).toRotationMatrix());
}

std::vector<Stand> stands_of(const PoseInput& input, const Knots& knots, const AttitudeFit& gyros,
                             const std::vector<Pose>& poses) {
  std::vector<Stand> stands;
  for (const Pose& pose : poses) {
    const auto C_rm = mean_attitude(knots, gyros, input.time_s[pose.first], input.time_s[pose.last - 1]);
    if (C_rm) {
      stands.push_back({C_rm->transpose(), pose.accel});
    }
  }
  return stands;
}

struct Linear {
  Matrix3 B = Matrix3::Identity();
  Vector3 bias = Vector3::Zero(), up;
  double square = std::numeric_limits<double>::infinity();
};

double square_of(const std::vector<Stand>& stands, const Linear& at, double g) {
  double square = 0.0;
  for (const Stand& s : stands) {
    square += (s.force - at.B * s.C_mr * at.up * g - at.bias).squaredNorm();
  }
  return square;
}

// Where the vertical is known, matrix and bias are linear; where they are, the vertical is.
Linear alternate(const std::vector<Stand>& stands, const Vector3& up, double g) {
  Linear at;
  at.up = up;
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix4d X = 1e-9 * Eigen::Matrix4d::Identity();
    Eigen::Matrix<double, 4, 3> XY = Eigen::Matrix<double, 4, 3>::Zero();
    for (const Stand& s : stands) {
      Eigen::Vector4d x;
      x << s.C_mr * at.up * g, 1.0;
      X += x * x.transpose();
      XY += x * s.force.transpose();
    }
    const Eigen::Matrix<double, 4, 3> by = X.ldlt().solve(XY);
    at.B = by.topRows<3>().transpose();
    at.bias = by.row(3).transpose();
    Matrix3 N = Matrix3::Zero();
    Vector3 n = Vector3::Zero();
    for (const Stand& s : stands) {
      const Matrix3 D = at.B * s.C_mr * g;
      N += D.transpose() * D;
      n += D.transpose() * (s.force - at.bias);
    }
    at.up = N.ldlt().solve(n).normalized();
  }
  if (at.B.determinant() < 0.0) {  // down and everything reversed is the same
    at.B = -at.B;
    at.up = -at.up;
  }
  at.square = square_of(stands, at, g);
  return at;
}

// What makes of a normal's 95 % those of Student's t.
double student(double degrees) {
  double low = 1.0, high = 100.0;
  constexpr double normal = 1.959964;
  constexpr int rounds = 60;
  for (int round = 0; round < rounds; ++round) {
    const double t = 0.5 * (low + high);
    (log_f_tail(t * t, 1.0, degrees) > std::log(0.05) ? low : high) = t;
  }
  return low / normal;
}

void polish(const std::vector<Stand>& stands, double g, Linear at, GravityFit& fit) {
  Eigen::Matrix<double, 14, 14> H;
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    fit.across.col(0) = at.up.unitOrthogonal();
    fit.across.col(1) = at.up.cross(fit.across.col(0));
    H.setZero();
    Eigen::Matrix<double, 14, 1> h = Eigen::Matrix<double, 14, 1>::Zero();
    for (const Stand& s : stands) {
      const Vector3 along = s.C_mr * at.up * g;
      Eigen::Matrix<double, 3, 14> J;
      for (Eigen::Index c = 0; c < 3; ++c) {
        J.middleCols<3>(3 * c) = along(c) * Matrix3::Identity();
      }
      J.middleCols<3>(9) = Matrix3::Identity();
      J.rightCols<2>() = at.B * s.C_mr * fit.across * g;
      H += J.transpose() * J;
      h += J.transpose() * (s.force - at.B * along - at.bias);
    }
    const Eigen::Matrix<double, 14, 1> step = H.ldlt().solve(h);
    for (Eigen::Index c = 0; c < 3; ++c) {
      at.B.col(c) += step.segment<3>(3 * c);
    }
    at.bias += step.segment<3>(9);
    at.up = (at.up + fit.across * step.tail<2>()).normalized();
  }
  const double degrees = 3.0 * static_cast<double>(stands.size()) - 14.0;
  const double variance = square_of(stands, at, g) / degrees;
  const double wide = student(degrees);
  fit.covariance = H.inverse() * variance * wide * wide;
  fit.rms = std::sqrt(variance);
  fit.B = at.B;
  fit.bias = at.bias;
  fit.up = at.up;
}

// Least variance of the direction of gravity in m, along whatever axis.
double least_spread(const std::vector<Stand>& stands, const Vector3& up) {
  Vector3 mean = Vector3::Zero();
  for (const Stand& s : stands) {
    mean += s.C_mr * up / static_cast<double>(stands.size());
  }
  Matrix3 spread = Matrix3::Zero();
  for (const Stand& s : stands) {
    const Vector3 off = s.C_mr * up - mean;
    spread += off * off.transpose() / static_cast<double>(stands.size());
  }
  return Eigen::SelfAdjointEigenSolver<Matrix3>(spread).eigenvalues()(0);
}

}  // namespace

GravityFit fit_gravity(const PoseInput& input, const Knots& knots, const AttitudeFit& gyros,
                       const std::vector<Pose>& poses) {
  GravityFit fit;
  const std::vector<Stand> stands = stands_of(input, knots, gyros, poses);
  fit.poses = static_cast<int>(stands.size());
  constexpr std::size_t fewest = 6;
  if (stands.size() < fewest) {
    fit.why_not = "it stands still with an attitude " + std::to_string(stands.size()) + " times, six are needed";
    return fit;
  }
  double size = 0.0;
  for (const Stand& s : stands) {
    size += s.force.norm() / static_cast<double>(stands.size());
  }
  fit.raw_per_si = input.accel_unit > 0.0 ? 1.0 / input.accel_unit : size / input.gravity;
  Linear best;
  for (const Vector3& up : {Vector3(0, 0, 1), Vector3(0, 1, 0), Vector3(1, 0, 0), Vector3(1, 1, 1).normalized()}) {
    const Linear found = alternate(stands, up, input.gravity);
    best = found.square < best.square ? found : best;
  }
  constexpr double least = 1e-3;  // a third is the same in all directions; sigma tells the rest
  if (least_spread(stands, best.up) < least) {
    fit.why_not = "gravity turns about one axis of the sensor only, or hardly at all";
    return fit;
  }
  polish(stands, input.gravity, best, fit);
  return fit;
}

}  // namespace selfcal::diagnosis
