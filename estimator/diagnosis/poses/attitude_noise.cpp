#include "estimator/diagnosis/poses/attitude_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace selfcal::diagnosis {

// After the first value: e = -delta, for z counts from there.
void LevelFilter::begin() {
  P11_ = P22_ = noise_.variance;
  P12_ = -noise_.variance;
}

LevelFilter::Step LevelFilter::predict(double length_s) {
  const double keeps = noise_.keeps > 0.0 ? std::pow(noise_.keeps, length_s / noise_.interval_s) : 0.0;
  P11_ += noise_.walk_psd * length_s;
  P12_ *= keeps;
  P22_ = keeps * keeps * P22_ + (1.0 - keeps * keeps) * noise_.variance;
  Step step;
  step.keeps = keeps;
  step.variance = P11_ + 2.0 * P12_ + P22_;
  step.level = (P11_ + P12_) / step.variance;
  step.error = (P12_ + P22_) / step.variance;
  return step;
}

void LevelFilter::update(const Step& step) {
  P11_ -= step.level * step.level * step.variance;
  P12_ -= step.level * step.error * step.variance;
  P22_ -= step.error * step.error * step.variance;
}

Innovations innovations_of(const std::vector<AttitudeRow>& rows, const Used& used, const AttitudeNoise& noise) {
  Innovations all;
  LevelFilter filter(noise);
  Vector3 z = Vector3::Zero(), level = z, error = z;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].begins) {
      filter.begin();
      z = level = error = Vector3::Zero();
    }
    z += rows[k].more;
    const LevelFilter::Step step = filter.predict(rows[k].length_s);
    error *= step.keeps;
    const Vector3 innovation = z - level - error;
    all.value.push_back(innovation);
    all.variance.push_back(step.variance);
    if (used[k]) {
      filter.update(step);
      level += step.level * innovation;
      error += step.error * innovation;
    }
  }
  return all;
}

namespace {

struct Profile {
  double log_likelihood = 0.0, variance = 0.0;
};

// The scale of both noises is profiled.
Profile profile(const std::vector<AttitudeRow>& rows, const Used& used, const AttitudeNoise& noise) {
  const Innovations all = innovations_of(rows, used, noise);
  double square = 0.0, logs = 0.0, count = 0.0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (used[k]) {
      square += all.value[k].squaredNorm() / all.variance[k];
      logs += std::log(all.variance[k]);
      count += 3.0;
    }
  }
  constexpr double least = 1e-30;
  const double variance = std::max(least, square / std::max(1.0, count));
  return {-0.5 * count * std::log(variance) - 1.5 * logs, variance};
}

// The ratio of both noises, by golden section in its logarithm.
AttitudeNoise best_ratio(const std::vector<AttitudeRow>& rows, const Used& used, AttitudeNoise noise, double& best) {
  const auto at = [&](double log_ratio) {
    noise.variance = 1.0;
    noise.walk_psd = std::exp(log_ratio) / noise.interval_s;
    return profile(rows, used, noise);
  };
  constexpr double low = -20.0, step = 2.0;
  constexpr int steps = 15;
  double top = low;
  best = -std::numeric_limits<double>::infinity();
  for (int k = 0; k <= steps; ++k) {
    const double x = low + k * step;
    const double here = at(x).log_likelihood;
    if (here > best) {
      best = here;
      top = x;
    }
  }
  double a = top - step, b = top + step;
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  constexpr int rounds = 14;
  for (int round = 0; round < rounds; ++round) {
    const double c = b - golden * (b - a), d = a + golden * (b - a);
    const bool left = at(c).log_likelihood > at(d).log_likelihood;
    a = left ? a : c;
    b = left ? d : b;
  }
  const Profile found = at(0.5 * (a + b));
  best = found.log_likelihood;
  noise.variance = found.variance;
  noise.walk_psd *= found.variance;
  return noise;
}

}  // namespace

AttitudeNoise fit_noise(const std::vector<AttitudeRow>& rows, const Used& used, double interval_s) {
  AttitudeNoise best;
  best.interval_s = interval_s;
  double best_likelihood = 0.0;
  best = best_ratio(rows, used, best, best_likelihood);
  constexpr double worth = 6.0;  // of log likelihood: chance gives as much to one more constant in 1 of 2000
  for (const double keeps : {0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98}) {
    AttitudeNoise noise;
    noise.interval_s = interval_s;
    noise.keeps = keeps;
    double likelihood = 0.0;
    noise = best_ratio(rows, used, noise, likelihood);
    if (likelihood > best_likelihood + (best.keeps == 0.0 ? worth : 0.0)) {
      best = noise;
      best_likelihood = likelihood;
    }
  }
  return best;
}

WeighedNoise beside(const AttitudeNoise& noise, double factor, const std::vector<AttitudeRow>& rows, const Used& used) {
  AttitudeNoise scaled = noise;
  scaled.walk_psd *= factor * factor / noise.variance;
  scaled.variance = 1.0;
  const Profile found = profile(rows, used, scaled);
  scaled.walk_psd *= found.variance;
  scaled.variance = found.variance;
  return {scaled, found.log_likelihood};
}

AttitudeInformation information_of(const std::vector<AttitudeRow>& rows, const Used& used, const AttitudeNoise& noise,
                                   const RowColumns& columns) {
  const Eigen::Index n = columns.size();
  constexpr Eigen::Index parts = 40, at_once = 128;
  AttitudeInformation all{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, parts)};
  LevelFilter filter(noise);
  Eigen::MatrixXd row(3, n + 1), z(3, n + 1), level(3, n + 1), error(3, n + 1), white(3 * at_once, n + 1);
  Eigen::Index filled = 0;
  const auto take_in = [&](Eigen::Index part) {
    const auto block = white.topRows(filled);
    const Eigen::VectorXd score = block.leftCols(n).transpose() * block.col(n);
    all.H.selfadjointView<Eigen::Lower>().rankUpdate(block.leftCols(n).transpose());
    all.h += score;
    all.scores.col(part) += score;
    filled = 0;
  };
  Eigen::Index part = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].begins) {
      filter.begin();
      z.setZero();
      level.setZero();
      error.setZero();
    }
    const auto now = static_cast<Eigen::Index>(k * static_cast<std::size_t>(parts) / rows.size());
    if (now != part || filled == white.rows()) {
      take_in(part);
      part = now;
    }
    columns.fill(rows[k], row.leftCols(n));
    row.col(n) = rows[k].more;
    z += row;
    const LevelFilter::Step step = filter.predict(rows[k].length_s);
    error *= step.keeps;
    if (used[k]) {
      const auto innovation = white.middleRows<3>(filled);
      white.middleRows<3>(filled) = z - level - error;
      filter.update(step);
      level += step.level * innovation;
      error += step.error * innovation;
      white.middleRows<3>(filled) /= std::sqrt(step.variance);
      filled += 3;
    }
  }
  take_in(part);
  all.H = all.H.selfadjointView<Eigen::Lower>();
  return all;
}

}  // namespace selfcal::diagnosis
