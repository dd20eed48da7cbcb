#include "estimator/diagnosis/poses/pose_regression.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

EffectContext context_of(double middle_s, const Vector3& u, double temperature, double duration_s) {
  EffectContext c;
  c.temperature = temperature;
  c.start_s = middle_s - 0.5;
  c.end_s = middle_s + 0.5;
  c.dt = 1.0;
  c.angle = c.rate = c.rate_change = c.field_b = Vector3::Zero();
  c.u = u;
  c.velocity = c.force = 9.80665 * u;
  c.C_nb = Matrix3::Identity();
  c.duration_s = duration_s;
  return c;
}

// Per coefficient, in one second at a pose: its middle, the direction of its specific force, whose size holds the reading's own noise, its
// temperature.
struct PerCoefficient {
  Eigen::Matrix3Xd velocity, angle;
};
PerCoefficient at_pose(const Effect& effect, double constant, const Pose& pose, double duration_s) {
  const auto count = static_cast<Eigen::Index>(effect.parameters.size());
  PerCoefficient p{Eigen::Matrix3Xd::Zero(3, count), Eigen::Matrix3Xd::Zero(3, count)};
  effect.sensor(context_of(pose.middle_s, pose.u.normalized(), pose.temperature, duration_s), constant, p.velocity,
                p.angle);
  return p;
}

Eigen::RowVectorXd row_of(const Effect& effect, double constant, const Pose& pose, double duration_s, int axis) {
  const PerCoefficient p = at_pose(effect, constant, pose, duration_s);
  return axis < 3 ? Eigen::RowVectorXd(p.angle.row(axis))
                  : Eigen::RowVectorXd(pose.u.normalized().transpose() * p.velocity);
}

// White noise and a random walk of this share: covariance of readings at these times.
Eigen::MatrixXd covariance_of(const std::vector<double>& time_s, double walk) {
  const auto n = static_cast<Eigen::Index>(time_s.size());
  Eigen::MatrixXd V = Eigen::MatrixXd::Identity(n, n);
  const double span = std::max(1e-9, time_s.back() - time_s.front());
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto earlier = static_cast<std::size_t>(std::min(i, j));
      V(i, j) += walk * (time_s[earlier] - time_s.front()) / span;
    }
  }
  return V;
}

// Restricted likelihood, logarithm, but for a constant.
double restricted(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const Eigen::MatrixXd& lower) {
  const auto L = lower.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd A = L.solve(X);
  const Eigen::VectorXd b = L.solve(y);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A);
  const Eigen::Index rank = qr.rank();
  const double square = (b - A * qr.solve(b)).squaredNorm();
  const double design = qr.matrixR().topLeftCorner(rank, rank).diagonal().array().abs().log().sum();
  const auto free = static_cast<double>(y.size() - rank);
  return -0.5 * free * std::log(std::max(square, 1e-300)) - lower.diagonal().array().log().sum() - design;
}

}  // namespace

Eigen::Matrix3Xd force_at(const Effect& effect, const Pose& pose, double duration_s) {
  return at_pose(effect, NAN, pose, duration_s).velocity;
}

void add_coefficients(const Trial& trial, const RowComparison& c, Eigen::Index known, PoseEffect& effect) {
  for (std::size_t j = 0; j < trial.names.size(); ++j) {
    effect.parameters.push_back(trial.names[j]);
    effect.value.push_back(c.with.value(known + static_cast<Eigen::Index>(j)));
    effect.sigma.push_back(c.with.sigma(known + static_cast<Eigen::Index>(j)));
  }
}

PoseEffect effect_in_force(const Trial& trial, const RowComparison& c, Eigen::Index known) {
  PoseEffect p;
  p.effect = trial.effect;
  p.constant = trial.constant;
  p.log_p = c.log_p;
  p.held_out_rms.fill(c.with.held_out_rms);
  add_coefficients(trial, c, known, p);
  return p;
}

Trial trial_of(const Effect& effect, double constant, const std::vector<Pose>& poses, double duration_s, int axis) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  const auto count = static_cast<Eigen::Index>(effect.parameters.size());
  Eigen::MatrixXd all(n, count);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Pose& pose = poses[static_cast<std::size_t>(k)];
    all.row(k) = row_of(effect, constant, pose, duration_s, axis);
  }
  Trial t{&effect, constant, Eigen::MatrixXd(n, 0), {}};
  for (Eigen::Index j = 0; j < count; ++j) {
    if (all.col(j).cwiseAbs().maxCoeff() > 0.0) {
      t.columns.conservativeResize(Eigen::NoChange, t.columns.cols() + 1);
      t.columns.rightCols<1>() = all.col(j);
      t.names.push_back(effect.parameters[static_cast<std::size_t>(j)].name);
    }
  }
  return t;
}

bool changes_with_time(const Effect& effect, double duration_s, int axis) {
  const double constant = effect.constant.tried().front();
  Pose pose;
  pose.u = Vector3(0.6, 0.48, 0.64);  // any direction that is along no axis
  pose.temperature = 1.0;             // the same early and late: not the time is what such an effect follows
  pose.middle_s = 0.1 * duration_s;
  const Eigen::RowVectorXd early = row_of(effect, constant, pose, duration_s, axis);
  pose.middle_s = 0.9 * duration_s;
  const Eigen::RowVectorXd late = row_of(effect, constant, pose, duration_s, axis);
  return (late - early).norm() > 1e-6 * (late.norm() + early.norm());
}

double tests_worth(const Effect& effect, const std::vector<Pose>& poses, double duration_s, int axis) {
  const std::vector<double> constants = effect.constant.tried();
  if (constants.size() < 2) {
    return 1.0;
  }
  Eigen::MatrixXd first(static_cast<Eigen::Index>(poses.size()), static_cast<Eigen::Index>(constants.size()));
  for (std::size_t k = 0; k < constants.size(); ++k) {
    const Trial trial = trial_of(effect, constants[k], poses, duration_s, axis);
    if (trial.columns.cols() == 0) {
      return 1.0;
    }
    Eigen::VectorXd column = trial.columns.col(0);
    column.array() -= column.mean();
    first.col(static_cast<Eigen::Index>(k)) = column / std::max(1e-300, column.norm());
  }
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(first.transpose() * first).eigenvalues().cwiseMax(0.0);
  const double roots = values.cwiseSqrt().sum();
  return std::max(1.0, roots * roots / std::max(1e-300, values.sum()));
}

bool acts_on(const Effect& effect, bool gyro, bool has_temperature) {
  return effect.sensor != nullptr && applies(effect, has_temperature) && !effect.needs_heading &&
         effect.triad == (gyro ? Triad::gyro : Triad::accelerometer);
}

Regression regress(const Eigen::MatrixXd& columns, const Eigen::VectorXd& y) {
  // Columns of one length: beside counts of 4e6 a g that of a bias is a 1e13th of that of a scale factor, which no rank would see.
  Eigen::VectorXd length = columns.colwise().norm();
  length = (length.array() > 0.0).select(length, 1.0);
  const Eigen::MatrixXd X = columns * length.cwiseInverse().asDiagonal();
  constexpr double dependent = 1e-10;  // of a column: that three products of a direction add up is rounded
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  qr.setThreshold(dependent).compute(X);
  Regression r;
  r.rank = qr.rank();
  const Eigen::VectorXd scaled = qr.solve(y);
  const Eigen::VectorXd e = y - X * scaled;
  const Eigen::MatrixXd Q = Eigen::MatrixXd(qr.householderQ()).leftCols(r.rank);
  r.square = e.squaredNorm();
  constexpr double share = 1e-24;
  r.rounding = share * y.squaredNorm();
  const Eigen::ArrayXd leverage = Q.rowwise().squaredNorm();
  r.held_out_rms = std::sqrt((e.array() / (1.0 - leverage).max(1e-9)).square().mean());
  const double variance = r.square / static_cast<double>(std::max<Eigen::Index>(1, y.size() - r.rank));
  const Eigen::MatrixXd G = X.transpose() * X;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse;
  inverse.setThreshold(dependent * dependent).compute(G);
  const Eigen::VectorXd square = (inverse.pseudoInverse().diagonal() * variance).cwiseMax(0.0);
  r.value = scaled.cwiseQuotient(length);
  r.sigma = square.cwiseSqrt().cwiseQuotient(length);
  return r;
}

RowComparison compare(const Eigen::MatrixXd& known, const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                      const std::vector<double>& time_s, bool of_time) {
  const auto n = y.size();
  if (of_time) {
    const Regression with = regress(joined(known, columns), y);
    return {with, log_p_of(regress(known, y), with, n)};
  }
  const Whitener white(known, y, time_s);
  const Eigen::VectorXd whitened = white(y);
  RowComparison c;
  c.with = regress(white(joined(known, columns)), whitened);
  c.log_p = log_p_of(regress(white(known), whitened), c.with, n);
  c.with.held_out_rms = regress(joined(known, columns), y).held_out_rms;  // in the reading's unit
  return c;
}

namespace {

// Lower root of the covariance of white noise and of flicker as the poses' halves tell it, by `sure` of its sigma more; none: they tell none.
std::optional<Eigen::LLT<Eigen::MatrixXd>> with_flicker(const std::vector<Pose>& poses,
                                                        const std::vector<double>& time_s, int axis, double sure) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  constexpr double median_of_square =
      0.4549;  // of a normal number of unit variance: a pose in which something else moved counts once
  double length_s = 0.0;
  Eigen::VectorXd white(n);
  std::vector<double> halves;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Pose& p = poses[static_cast<std::size_t>(k)];
    white(k) = p.gyro_white(axis) * p.gyro_white(axis);
    halves.push_back(p.gyro_half(axis) * p.gyro_half(axis));
    length_s += p.length_s / static_cast<double>(n);
  }
  std::nth_element(halves.begin(), halves.begin() + n / 2, halves.end());
  const double half = halves[static_cast<std::size_t>(n / 2)] / median_of_square;
  // Of a variance by the median of n squares: 1 / (2 f(m) m sqrt(n)) = 2.33 / sqrt(n), f and m density and median of chi squared of one.
  constexpr double of_median = 2.33;
  const double sigma = of_median * half / std::sqrt(static_cast<double>(n));
  const double level = (half + sure * sigma - white.mean()) / std::log(2.0);
  const double times = (time_s.back() - time_s.front()) / length_s;
  if (!(level > 0.0) || !(times > 1.0)) {
    return std::nullopt;
  }
  constexpr double far_apart = 1.5, beyond = 1.0;
  const double variance = std::log(times) + far_apart + beyond;  // any constant is the bias
  Eigen::MatrixXd covariance = white.asDiagonal();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double apart_s = std::abs(time_s[static_cast<std::size_t>(i)] - time_s[static_cast<std::size_t>(j)]);
      covariance(i, j) +=
          level * (i == j ? variance : variance - far_apart - std::log(std::max(1.0, apart_s / length_s)));
    }
  }
  Eigen::LLT<Eigen::MatrixXd> root(covariance);
  return root.info() == Eigen::Success ? std::optional(std::move(root)) : std::nullopt;
}

}  // namespace

double log_p_beside_flicker(const std::vector<Pose>& poses, const std::vector<double>& time_s, int axis,
                            const Eigen::MatrixXd& known, const Eigen::MatrixXd& columns, const Eigen::VectorXd& y,
                            double sure) {
  const auto root = with_flicker(poses, time_s, axis, sure);
  if (!root) {
    return -HUGE_VAL;
  }
  const Eigen::VectorXd whitened = root->matrixL().solve(y);
  const Regression without = regress(root->matrixL().solve(known), whitened);
  const Regression with = regress(root->matrixL().solve(joined(known, columns)), whitened);
  const auto more = static_cast<double>(with.rank - without.rank);
  return more < 1.0 ? 0.0 : log_chi_squared_tail(std::max(0.0, without.square - with.square), more);
}

void hold_flicker(const std::vector<Pose>& poses, const std::vector<double>& time_s, int axis,
                  const Eigen::MatrixXd& columns, Eigen::Index first, Regression& r) {
  const auto root = with_flicker(poses, time_s, axis, 0.0);
  if (!root) {
    return;
  }
  const Eigen::MatrixXd L = root->matrixL();
  const Eigen::MatrixXd fit = columns.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::Index n = columns.cols() - first;
  r.sigma.tail(n) = r.sigma.tail(n).cwiseMax((fit * L).rowwise().norm().tail(n));
}

std::vector<double> middles(const std::vector<Pose>& poses) {
  std::vector<double> time_s;
  time_s.reserve(poses.size());
  for (const Pose& p : poses) {
    time_s.push_back(p.middle_s);
  }
  return time_s;
}

Eigen::MatrixXd joined(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd all(a.rows(), a.cols() + b.cols());
  all << a, b;
  return all;
}

double log_p_of(const Regression& without, const Regression& with, Eigen::Index n) {
  const auto more = static_cast<double>(with.rank - without.rank);
  const auto left = static_cast<double>(n - with.rank);
  if (more < 1.0 || left < 1.0 || without.square <= without.rounding) {
    return 0.0;
  }
  return log_f_tail((without.square - with.square) / more / (with.square / left), more, left);
}

Whitener::Whitener(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<double>& time_s) {
  double best = -HUGE_VAL;
  for (const double walk : {0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0}) {
    const Eigen::MatrixXd lower = covariance_of(time_s, walk).llt().matrixL();
    const double likelihood = restricted(X, y, lower);
    if (likelihood > best) {
      best = likelihood;
      lower_ = lower;
    }
  }
}

Eigen::MatrixXd Whitener::operator()(const Eigen::MatrixXd& columns) const {
  return lower_.triangularView<Eigen::Lower>().solve(columns);
}

}  // namespace selfcal::diagnosis
