#include "estimator/diagnosis/poses/read_out_oscillation.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

double interval_of(const PoseInput& input) {
  return (input.time_s.back() - input.time_s.front()) / static_cast<double>(input.time_s.size() - 1);
}

// Root mean square of what the angle moves by in windows of `length` samples.
double moved_in(const std::vector<double>& angle, std::size_t length) {
  double square = 0.0, count = 0.0;
  for (std::size_t i = 0; i + length < angle.size(); i += length) {
    square += std::pow(angle[i + length] - angle[i], 2);
    count += 1.0;
  }
  return std::sqrt(square / std::max(1.0, count));
}

// The longest windows in which the angle still moves in proportion to their length: quanta of the read-out count least there.
std::size_t window_of(const std::vector<double>& angle) {
  constexpr double in_proportion = 1.9;
  std::size_t length = 2;
  while (8 * length < angle.size() && moved_in(angle, 2 * length) > in_proportion * moved_in(angle, length)) {
    length *= 2;
  }
  return length;
}

double angle_at(const PoseInput& input, const std::vector<double>& angle, double t) {
  const auto after = std::lower_bound(input.time_s.begin(), input.time_s.end(), t);
  if (after == input.time_s.begin() || after == input.time_s.end()) {
    return after == input.time_s.end() ? angle.back() : angle.front();
  }
  const auto k = static_cast<std::size_t>(after - input.time_s.begin());
  const double share = (t - input.time_s[k - 1]) / (input.time_s[k] - input.time_s[k - 1]);
  return (1.0 - share) * angle[k - 1] + share * angle[k];
}

// Windows without a gap: means of the gyros, and where they begin and end.
struct Windows {
  std::vector<double> from_s, to_s;
  Eigen::MatrixXd gyro;  // raw, [windows x 3]
};

Windows windows_of(const PoseInput& input, std::size_t length) {
  std::vector<Vector3> means;
  Windows w;
  const double most_s = 1.5 * static_cast<double>(length) * interval_of(input);
  for (std::size_t i = 0; i + length < input.time_s.size(); i += length) {
    if (input.time_s[i + length] - input.time_s[i] > most_s) {
      continue;
    }
    Vector3 sum = Vector3::Zero();
    for (std::size_t k = i + 1; k <= i + length; ++k) {  // a sample is the mean up to its time
      sum += at(input.gyro, k) * (input.time_s[k] - input.time_s[k - 1]);
    }
    w.from_s.push_back(input.time_s[i]);
    w.to_s.push_back(input.time_s[i + length]);
    means.push_back(sum / (input.time_s[i + length] - input.time_s[i]));
  }
  w.gyro.resize(static_cast<Eigen::Index>(means.size()), 3);
  for (std::size_t k = 0; k < means.size(); ++k) {
    w.gyro.row(static_cast<Eigen::Index>(k)) = means[k].transpose();
  }
  return w;
}

// Rates of the read-out in the windows, as it would show them `delay_s` later.
Eigen::VectorXd rates_of(const PoseInput& input, const std::vector<double>& angle, const Windows& w, double delay_s) {
  Eigen::VectorXd rates(w.gyro.rows());
  for (Eigen::Index k = 0; k < rates.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    rates(k) = (angle_at(input, angle, w.to_s[i] + delay_s) - angle_at(input, angle, w.from_s[i] + delay_s)) /
               (w.to_s[i] - w.from_s[i]);
  }
  return rates;
}

struct Line {
  Eigen::VectorXd value, sigma, left;
};

// Least squares; sigma holds that what is left goes on from window to window.
Line fit(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  const Eigen::LDLT<Eigen::MatrixXd> normal(X.transpose() * X);
  Line line;
  line.value = normal.solve(X.transpose() * y);
  line.left = y - X * line.value;
  const Eigen::Index n = y.size();
  const double square = line.left.squaredNorm();
  const double next = line.left.head(n - 1).dot(line.left.tail(n - 1)) / std::max(square, 1e-300);
  const double colour = std::max(1.0, (1.0 + next) / std::max(0.01, 1.0 - next));
  const double variance = colour * square / static_cast<double>(std::max<Eigen::Index>(1, n - X.cols()));
  line.sigma = (normal.solve(Eigen::MatrixXd::Identity(X.cols(), X.cols())).diagonal() * variance).cwiseSqrt();
  return line;
}

// Bias and response at a delay.
Eigen::MatrixXd columns_of(const Eigen::VectorXd& rates) {
  Eigen::MatrixXd X(rates.size(), 2);
  X << Eigen::VectorXd::Ones(rates.size()), rates;
  return X;
}

int reversals(const std::vector<double>& angle) {
  constexpr double least = 0.5 * units::degree;
  int count = 0;
  double extreme = angle.front(), direction = 0.0;
  for (const double a : angle) {
    const double off = a - extreme;
    if (direction == 0.0 && std::abs(off) > least) {
      direction = off;
    }
    if (direction * off > 0.0) {
      extreme = a;
    } else if (direction != 0.0 && std::abs(off) > least) {
      ++count;
      direction = off;
      extreme = a;
    }
  }
  return count;
}

}  // namespace

std::optional<Oscillation> judge_oscillation(const PoseInput& input, bool outer) {
  const std::vector<double>& angle = outer ? input.outer : input.inner;
  constexpr double least = 1.0 * units::degree, explained = 0.9;
  constexpr int enough = 4;
  constexpr Eigen::Index fewest = 50;
  const auto [low, high] = std::minmax_element(angle.begin(), angle.end());
  const int turns = *high - *low < least ? 0 : reversals(angle);
  if (turns < enough) {
    return std::nullopt;
  }
  const std::size_t length = window_of(angle);
  const Windows w = windows_of(input, length);
  if (w.gyro.rows() < fewest) {
    return std::nullopt;
  }
  // The axis that turns most, and the delay at which least is left of it: a grid of half windows, then Newton's steps.
  Eigen::Index main = 0;
  (w.gyro.rowwise() - w.gyro.colwise().mean()).colwise().squaredNorm().maxCoeff(&main);
  const Eigen::VectorXd y = w.gyro.col(main);
  const double window_s = static_cast<double>(length) * interval_of(input);
  constexpr double reach_s = 0.5;
  double delay_s = 0.0, left = HUGE_VAL;
  for (int k = -static_cast<int>(reach_s / (0.5 * window_s)); 0.5 * k * window_s <= reach_s; ++k) {
    const double square = fit(columns_of(rates_of(input, angle, w, 0.5 * k * window_s)), y).left.squaredNorm();
    if (square < left) {
      left = square;
      delay_s = 0.5 * k * window_s;
    }
  }
  Oscillation o;
  for (int round = 0; round < 5; ++round) {
    const double step_s = 0.1 * window_s;
    const Eigen::VectorXd rates = rates_of(input, angle, w, delay_s);
    const Line now = fit(columns_of(rates), y);
    Eigen::MatrixXd X(rates.size(), 3);
    X << columns_of(rates),
        now.value(1) * (rates_of(input, angle, w, delay_s + step_s) - rates_of(input, angle, w, delay_s - step_s)) /
            (2.0 * step_s);
    const Line with = fit(X, y);
    delay_s += with.value(2);
    o.delay_sigma_s = with.sigma(2);
  }
  const Eigen::MatrixXd X = columns_of(rates_of(input, angle, w, delay_s));
  const double all = (y.array() - y.mean()).square().sum();
  if (fit(X, y).left.squaredNorm() > (1.0 - explained) * all) {
    return std::nullopt;
  }
  o.delay_s = delay_s;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Line line = fit(X, w.gyro.col(axis));
    o.bias(axis) = line.value(0);
    o.bias_sigma(axis) = line.sigma(0);
    o.axis.response(axis) = line.value(1) * input.gyro_unit;
    o.axis.sigma(axis) = line.sigma(1) * input.gyro_unit;
  }
  o.axis.name = outer ? "outer" : "inner";
  o.axis.oscillates = true;
  o.axis.rows = turns;
  for (std::size_t i = 1; i < angle.size(); ++i) {
    o.axis.turned_deg += std::abs(angle[i] - angle[i - 1]) / units::degree;
  }
  return o;
}

}  // namespace selfcal::diagnosis
