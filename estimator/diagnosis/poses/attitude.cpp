#include "estimator/diagnosis/poses/attitude.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>

#include "estimator/diagnosis/poses/attitude_gravity.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

using Nine = Eigen::Matrix<double, 9, 1>;

Matrix3 matrix_of(const Eigen::VectorXd& v) { return Eigen::Map<const Matrix3>(v.data()); }

// M = (A A^T)^1/2, C_bm = M^-1 A.
Matrix3 symmetric_root(const Matrix3& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(A * A.transpose());
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseSqrt().asDiagonal() * eigen.eigenvectors().transpose();
}

// B = K Q, K upper triangular with a positive diagonal: K K^T = B B^T, the factor of the matrix with its axes in reverse.
Matrix3 upper_root(const Matrix3& B) {
  Matrix3 J = Matrix3::Zero();
  J(0, 2) = J(1, 1) = J(2, 0) = 1.0;
  const Matrix3 L = Eigen::LLT<Matrix3>(J * B * B.transpose() * J).matrixL();
  return J * L * J;
}

struct Told {
  Eigen::VectorXd value, sigma;
};

// A function of the estimates, with sigma by central differences.
Told propagate(const Eigen::VectorXd& x, const Eigen::MatrixXd& covariance,
               const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f) {
  Told told;
  told.value = f(x);
  Eigen::MatrixXd J(told.value.size(), x.size());
  const double size = x.cwiseAbs().maxCoeff();
  constexpr double part = 1e-6;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const Eigen::VectorXd step = part * size * Eigen::VectorXd::Unit(x.size(), k);
    J.col(k) = (f(x + step) - f(x - step)) / (2.0 * part * size);
  }
  told.sigma = (J * covariance * J.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  return told;
}

// Covariance of A = W^-1, by columns: dA = -A dW A.
Eigen::MatrixXd covariance_of_response(const AttitudeFit& fit) {
  const Matrix3 A = fit.model.W.inverse();
  const Eigen::Index n = 3 * fit.layout.axes;
  Eigen::MatrixXd J(9, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Matrix3 dW = Vector3::Unit(k % 3) * fit.model.seen.col(k / 3).transpose();
    const Matrix3 dA = -A * dW * A;
    J.col(k) = Eigen::Map<const Nine>(dA.data());
  }
  return J * fit.covariance.topLeftCorner(n, n) * J.transpose();
}

constexpr const char* axes = "xyz";

void add_parameter(const std::string& name, double value, double sigma, std::vector<PoseParameter>& all) {
  constexpr double before = 0.1;  // as of gyros by gravity
  all.push_back({name, "1", value, sigma, sigma < 0.5 * before});
}

std::string element(Eigen::Index i, Eigen::Index j) {
  return i == j ? std::string("scale_") + axes[i] : std::string("misalignment_") + axes[i] + axes[j];
}

Vector3 mount_of(const Matrix3& C) { return rotation_vector_from_matrix(C); }

// Only M's symmetric part: no gravity says how the tracker lies on the IMU.
void tell_symmetric(const AttitudeFit& fit, ByAttitude& d) {
  const Matrix3 A = fit.model.W.inverse() / d.raw_per_si;
  const Eigen::VectorXd x = Eigen::Map<const Nine>(A.data());
  const Told told =
      propagate(x, covariance_of_response(fit) / (d.raw_per_si * d.raw_per_si), [](const Eigen::VectorXd& v) {
        const Matrix3 response = matrix_of(v), M = symmetric_root(response);
        Eigen::VectorXd y(9);
        y << M(0, 0), M(1, 1), M(2, 2), M(0, 1), M(0, 2), M(1, 2), mount_of(M.inverse() * response);
        return y;
      });
  Eigen::Index k = 0;
  for (const auto& [i, j] : {std::pair{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}) {
    add_parameter(element(i, j), told.value(k) - (i == j ? 1.0 : 0.0), told.sigma(k), d.gyros);
    ++k;
  }
  d.mount = told.value.tail<3>();
  d.mount_sigma = told.sigma.tail<3>();
}

// All nine of M in the accelerometers' frame, and K.
void tell_both(const AttitudeFit& fit, const GravityFit& gravity, ByAttitude& d) {
  const Matrix3 A = fit.model.W.inverse() / d.raw_per_si, B = gravity.B / gravity.raw_per_si;
  Eigen::VectorXd x(18);
  x << Eigen::Map<const Nine>(A.data()), Eigen::Map<const Nine>(B.data());
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(18, 18);
  P.topLeftCorner<9, 9>() = covariance_of_response(fit) / (d.raw_per_si * d.raw_per_si);
  P.bottomRightCorner<9, 9>() = gravity.covariance.topLeftCorner<9, 9>() / (gravity.raw_per_si * gravity.raw_per_si);
  const Told told = propagate(x, P, [](const Eigen::VectorXd& v) {
    const Matrix3 force = matrix_of(v.tail<9>()), K = upper_root(force), Q = K.inverse() * force;
    const Matrix3 M = matrix_of(v.head<9>()) * Q.transpose();
    Eigen::VectorXd y(18);
    y << Eigen::Map<const Nine>(M.data()), K(0, 0), K(1, 1), K(2, 2), K(0, 1), K(0, 2), K(1, 2), mount_of(Q);
    return y;
  });
  d.by_accelerometers = true;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      add_parameter(element(i, j), told.value(3 * j + i) - (i == j ? 1.0 : 0.0), told.sigma(3 * j + i), d.gyros);
    }
  }
  std::vector<PoseParameter>& accel = d.gravity->parameters;
  Eigen::Index k = 9;
  for (const auto& [i, j] : {std::pair{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}) {
    add_parameter(element(i, j), told.value(k) - (i == j ? 1.0 : 0.0), told.sigma(k), accel);
    ++k;
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    accel.push_back(
        {std::string("bias_") + axes[i], "raw", gravity.bias(i), std::sqrt(gravity.covariance(9 + i, 9 + i)), true});
  }
  d.mount = told.value.tail<3>();
  d.mount_sigma = told.sigma.tail<3>();
}

void tell_lean(const GravityFit& fit, GravityByAttitude& d) {
  Eigen::Index axis = 0;
  fit.up.cwiseAbs().maxCoeff(&axis);
  const Vector3 near = fit.up(axis) < 0.0 ? Vector3(-Vector3::Unit(axis)) : Vector3(Vector3::Unit(axis));
  d.lean_axis = std::string(fit.up(axis) < 0.0 ? "-" : "") + axes[axis];
  const Vector3 off = fit.up - near * near.dot(fit.up);
  d.lean_deg = std::atan2(off.norm(), near.dot(fit.up)) / units::degree;
  const Vector3 along = off.norm() > 0.0 ? Vector3(off.normalized()) : fit.up.unitOrthogonal();
  const Eigen::Vector2d by = fit.across.transpose() * along;
  d.lean_sigma_deg =
      std::sqrt((by.transpose() * fit.covariance.bottomRightCorner<2, 2>() * by).value()) / units::degree;
}

// Where nothing turns the gyros show their own noise: a reference does not know it.
Independence independence_of(const PoseInput& input, const AttitudeFit& fit, const std::vector<Pose>& poses) {
  Independence found;
  double product = 0.0, own = 0.0, other = 0.0, count = 0.0, neighbours = 0.0;
  for (const Pose& pose : poses) {
    std::vector<std::size_t> rows;
    for (std::size_t k = 0; k < fit.rows.size(); ++k) {
      const AttitudeRow& row = fit.rows[k];
      if (row.time_s > input.time_s[pose.first] && row.time_s < input.time_s[pose.last - 1] && fit.used[k]) {
        rows.push_back(k);
      }
    }
    Vector3 mean_more = Vector3::Zero(), mean_turn = Vector3::Zero();
    double seconds = 0.0;
    std::vector<Vector3> turns;
    for (const std::size_t k : rows) {
      const AttitudeRow& row = fit.rows[k];
      const Eigen::Quaterniond &now = fit.q_rm[row.knot], &before = fit.q_rm[row.knot - 1];
      turns.emplace_back(now * rotation_vector(before.conjugate() * now) - row.more);
      mean_more += row.more;
      mean_turn += turns.back();
      seconds += row.length_s;
    }
    Vector3 last = Vector3::Zero();
    for (std::size_t j = 0; j < rows.size(); ++j) {
      const AttitudeRow& row = fit.rows[rows[j]];
      const Vector3 more = row.more - mean_more * (row.length_s / seconds);
      const Vector3 turn = turns[j] - mean_turn * (row.length_s / seconds);
      product -= more.dot(turn);
      own += turn.squaredNorm();
      other += more.squaredNorm();
      neighbours += j > 0 ? last.dot(turn) : 0.0;
      count += 3.0;
      last = turn;
    }
  }
  constexpr double fewest = 300.0, certain = 4.0, half = 0.5, white = 0.3;
  // Coloured, they show a motion of the ground, which both may see.
  if (count < fewest || !(own > 0.0) || std::abs(neighbours / own) > white) {
    return found;
  }
  found.value = product / own;
  found.sigma = std::sqrt(std::max(1e-300, (other - product * product / own) / count / own));
  found.derived = found.value + certain * found.sigma < half;
  found.shown = found.value - certain * found.sigma > half;
  return found;
}

void tell_clock_and_noise(const AttitudeFit& fit, ByAttitude& d) {
  const AttitudeLayout& at = fit.layout;
  const Eigen::VectorXd sigma = fit.covariance.diagonal().cwiseSqrt();
  d.bias = fit.mean_bias;
  d.bias_sigma = fit.mean_bias_sigma;
  d.slope = fit.model.slope;
  d.slope_sigma = sigma.segment<3>(at.slope());
  d.walk = std::sqrt(fit.walk_psd);
  d.gyro_asd = std::sqrt(fit.noise.walk_psd) / std::cbrt(std::abs(fit.model.W.determinant()));
  d.delay_s = fit.model.delay_s;
  d.delay_sigma_s = sigma(at.delay());
  d.drift_ppm = fit.model.drift / units::ppm;
  d.drift_sigma_ppm = sigma(at.drift()) / units::ppm;
  d.smoothing_s2 = fit.model.smoothing;
  d.smoothing_sigma_s2 = sigma(at.smoothing());
  constexpr double coarse = 0.05;  // s
  d.delay_seen = d.delay_sigma_s < coarse;
  d.noise_rad = std::sqrt(fit.noise.variance);
  d.noise_time_s = fit.noise.keeps > 0.0 ? -fit.noise.interval_s / std::log(fit.noise.keeps) : 0.0;
  d.earth = fit.model.earth;
  d.earth_sigma = sigma.segment<3>(at.earth());
  d.misfit = fit.misfit;
}

void tell_rows(const AttitudeFit& fit, ByAttitude& d) {
  for (std::size_t k = 0; k < fit.rows.size(); ++k) {
    d.samples += fit.used[k] ? 1 : 0;
    d.seconds += fit.used[k] ? fit.rows[k].length_s : 0.0;
    d.pieces += fit.rows[k].begins ? 1 : 0;
  }
  d.left_out += fit.left_out;
  d.held = fit.held;
  d.held_s = fit.held_s;
}

void tell_gains(const AttitudeFit& fit, ByAttitude& d) {
  for (Eigen::Index c = 0; c < fit.layout.axes; ++c) {
    const Vector3 along = fit.model.seen.col(c), turned = fit.model.W * along;
    const Vector3 by = turned / std::pow(turned.norm(), 3);
    const Eigen::Index at = fit.layout.W() + 3 * c;
    d.gains.push_back({along, 1.0 / turned.norm() / d.raw_per_si,
                       std::sqrt(by.dot(fit.covariance.block<3, 3>(at, at) * by)) / d.raw_per_si});
  }
}

// Nominal raw units per rad/s, or what they are where the nominal one is far off.
double unit_of(const PoseInput& input, const AttitudeFit& fit) {
  const double nominal = 1.0 / input.gyro_unit;
  const double seen = fit.layout.axes == 3 ? 1.0 / std::cbrt(std::abs(fit.model.W.determinant()))
                                           : 1.0 / (fit.model.W * fit.model.seen.col(0)).norm();
  constexpr double any_gain = 2.0;  // as of angle read-outs
  return seen > any_gain * nominal || seen < nominal / any_gain ? seen : nominal;
}

void tell_open(const AttitudeFit& fit, const std::string& why_no_gravity, ByAttitude& d) {
  if (fit.layout.axes < 3) {
    const Eigen::Index open = 9 - 3 * fit.layout.axes;
    d.invisible.push_back(std::to_string(open) + " of the 9 elements of the gyros' matrix: the attitude turns about " +
                          (fit.layout.axes == 1 ? "one axis" : "two axes") +
                          " only, and how the sensor lies on what is tracked is not known");
  } else if (!d.by_accelerometers) {
    d.invisible.emplace_back(
        "3 of the 9 elements of the gyros' matrix: the rotation from what is tracked to the sensor, which only gravity "
        "fixes; misalignments are symmetric, xy = yx");
  }
  if (!why_no_gravity.empty()) {
    d.invisible.push_back("accelerometers by the attitude: " + why_no_gravity);
  }
  if (!d.delay_seen) {
    d.invisible.emplace_back("delay and drift of the attitude's clock: the rate of turn hardly changes");
  }
}

// The largest angle from the first attitude.
double reach_of(const ReferenceAttitude& attitude, const Knots& knots) {
  const auto& q = attitude.readings.front().q_rm;
  double largest = 0.0;
  for (const Knot& knot : knots.all) {
    largest = std::max(largest, q[knots.all.front().sample].angularDistance(q[knot.sample]));
  }
  return largest;
}

std::string why_not(const PoseInput& input, const ReferenceAttitude& attitude, const Knots& knots) {
  if (knots.all.empty()) {
    constexpr std::size_t few = 30;
    const std::size_t rows = attitude.time_s.size() - knots.without;
    return rows == 0    ? "no row of it holds an attitude"
           : rows < few ? std::to_string(rows) + " rows of it hold an attitude: too few"
                        : "it never changes: no turn to hold gyros against";
  }
  constexpr double least_deg = 1.0;
  const double reach = reach_of(attitude, knots) / units::degree;
  if (reach < least_deg) {
    return "it turns by " + std::to_string(reach) + " deg at most: no turn to hold gyros against";
  }
  if (knots.all.back().time_s < input.time_s.front() || knots.all.front().time_s > input.time_s.back()) {
    return "no overlap in time: " + std::to_string(knots.all.front().time_s) + " to " +
           std::to_string(knots.all.back().time_s) + " s, the log " + std::to_string(input.time_s.front()) + " to " +
           std::to_string(input.time_s.back()) + " s";
  }
  return {};
}

}  // namespace

ByAttitude judge_attitude(const PoseInput& input, const ReferenceAttitude& attitude, const std::vector<Pose>& poses) {
  ByAttitude d;
  const Knots knots = find_knots(attitude);
  d.without = knots.without;
  d.left_out = knots.left_out;
  d.interval_s = knots.interval_s;
  d.failure = why_not(input, attitude, knots);
  if (!d.failure.empty()) {
    return d;
  }
  const GyroTrack track = track_of(input);
  const AttitudeStart start = find_start(track, attitude, knots);
  d.failure = start.failure;
  if (!d.failure.empty()) {
    return d;
  }
  if (start.model.W.determinant() < 0.0) {
    d.failure = "it turns the other way round than the gyros: one of them is left-handed";
    return d;
  }
  const AttitudeFit fit = fit_attitude(track, attitude, knots, start);
  if (fit.rows.empty()) {
    d.failure = "no stretch of it lies in the log without a gap";
    return d;
  }
  d.reading = attitude.readings[start.reading].words;
  d.read_by_data = attitude.readings.size() > start.as_well.size() + 1;
  for (const std::size_t k : start.as_well) {
    d.read_as_well.push_back(attitude.readings[k].words);
  }
  tell_rows(fit, d);
  d.turned_deg = start.turned / units::degree;
  d.axes = static_cast<int>(fit.layout.axes);
  d.raw_per_si = unit_of(input, fit);
  tell_clock_and_noise(fit, d);
  d.independence = independence_of(input, fit, poses);
  if (d.independence.derived) {
    d.failure = "it holds the gyros' own noise, as only an attitude does that was computed from them: no reference";
    return d;
  }
  std::string why_no_gravity = input.sensors == Sensors::gyros ? "the log holds none" : "";
  if (fit.layout.axes < 3) {
    tell_gains(fit, d);
    why_no_gravity = why_no_gravity.empty() ? "its turns do not reach three axes" : why_no_gravity;
  } else if (why_no_gravity.empty()) {
    const GravityFit gravity = fit_gravity(input, knots, fit, poses);
    why_no_gravity = gravity.why_not;
    if (why_no_gravity.empty()) {
      d.gravity.emplace();
      d.gravity->poses = gravity.poses;
      d.gravity->rms = gravity.rms / gravity.raw_per_si;
      tell_both(fit, gravity, d);
      tell_lean(gravity, *d.gravity);
    }
  }
  if (fit.layout.axes == 3 && !d.gravity) {
    tell_symmetric(fit, d);
  }
  tell_open(fit, why_no_gravity, d);
  return d;
}

}  // namespace selfcal::diagnosis
