#include "estimator/passes/motion_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace selfcal {
namespace {

constexpr int most_oscillations = 8;
constexpr int frequency_steps = 3;  // of the scoring, frequencies alone
constexpr int scoring_steps = 12;   // of the scoring of all
// Periodogram of white noise, three axes, per axis's mean: gamma distributed with shape 3, median 2.674. Above 25 it is
// a line: P = 25^2/2 exp(-25) a bin, once in some 10^5 series by chance; and the Bayesian information criterion asks
// for no less (five unknowns, each 0.5 ln(3 x 3000)).
constexpr double gamma3_median = 2.674;
constexpr double line_power = 25.0;
constexpr double enough = 0.5;        // gain of log likelihood that ends the scoring
constexpr double least_sigma = 1e-6;  // m: less is not motion, a still base's noise is no smaller
constexpr double least_decay_s = 10.0;
constexpr double longest_decay = 1e6;      // in lengths of the series: a pure line, decimetres of it change by um
constexpr double slowest_period_s = 60.0;  // slower is the wander of the navigation, which the filter knows

// Unknowns: logarithm of the white sigma, then per oscillation omega (in 1/length of the series), logarithm of the
// decay, and logarithms of the three sigmas. All of them move by about 1 where the likelihood changes its shape.
constexpr Eigen::Index per_line = 5;
using Unknowns = Eigen::VectorXd;

class MotionFit {
 public:
  MotionFit(const DriftSeries& series, const DriftNoise& noise)
      : series_(series), noise_(noise), length_s_(static_cast<double>(series.size()) * series.interval_s) {
    theta_ = Unknowns::Constant(1, std::log(noise.white_sigma));
    filter_all(theta_, now_);
  }

  ObservationModel fit() {
    std::vector<Eigen::Index> frequencies, all{0};
    for (int lines = 0; lines < most_oscillations; ++lines) {
      const std::optional<double> omega = strongest_line();
      if (!omega) {
        break;
      }
      const Eigen::Index at = theta_.size();
      add_line(*omega);
      frequencies.push_back(at);
      for (Eigen::Index k = 0; k < per_line; ++k) {
        all.push_back(at + k);
      }
      score(frequencies, frequency_steps);
    }
    choose_decay();
    score(all, scoring_steps);
    return model(theta_);
  }

 private:
  using Innovations = std::array<AxisInnovations, 3>;

  static double log_likelihood(const Innovations& innovations) {
    return innovations[0].log_likelihood + innovations[1].log_likelihood + innovations[2].log_likelihood;
  }

  Oscillation oscillation(const Unknowns& theta, Eigen::Index line, int axis) const {
    const auto at = 1 + per_line * line;
    return {theta(at) / length_s_, std::exp(theta(at + 1)), std::exp(theta(at + 2 + axis))};
  }

  // Oscillations too small for an axis are left out of it.
  ObservationModel model(const Unknowns& theta) const {
    ObservationModel observation;
    observation.sigma = std::exp(theta(0));
    for (int axis = 0; axis < 3; ++axis) {
      for (Eigen::Index line = 0; line < theta.size() / per_line; ++line) {
        const Oscillation o = oscillation(theta, line, axis);
        if (o.sigma > least_sigma) {
          observation.motion[static_cast<std::size_t>(axis)].oscillations.push_back(o);
        }
      }
    }
    return observation;
  }

  void filter_one(const Unknowns& theta, int axis, AxisInnovations& out) const {
    DriftNoise noise = noise_;
    noise.white_sigma = std::exp(theta(0));
    MotionModel motion;
    motion.oscillations.reserve(static_cast<std::size_t>(theta.size() / per_line));
    for (Eigen::Index line = 0; line < theta.size() / per_line; ++line) {
      motion.oscillations.push_back(oscillation(theta, line, axis));
    }
    filter_axis(series_, axis, noise, motion, out);
  }
  void filter_all(const Unknowns& theta, Innovations& out) const {
    for (int axis = 0; axis < 3; ++axis) {
      filter_one(theta, axis, out[static_cast<std::size_t>(axis)]);
    }
  }

  std::optional<double> strongest_line() const;
  void add_line(double omega);
  void choose_decay();
  void score(const std::vector<Eigen::Index>& which, int most_steps);
  void gradient(const std::vector<Eigen::Index>& which, Eigen::VectorXd& g, Eigen::MatrixXd& F) const;
  void keep_possible(Unknowns& theta) const;

  const DriftSeries& series_;
  DriftNoise noise_;
  double length_s_;
  Unknowns theta_;
  Innovations now_;
};

// (M4): where the Hann-windowed periodogram of the normalised innovations is highest, the axes together, rad/s; none
// where noise alone gets as high.
std::optional<double> MotionFit::strongest_line() const {
  const std::size_t count = series_.size();
  std::size_t padded = 1;
  while (padded < 4 * count) {
    padded *= 2;
  }
  Eigen::ArrayXd power = Eigen::ArrayXd::Zero(static_cast<Eigen::Index>(padded / 2));
  Eigen::FFT<double> fft;
  std::vector<double> windowed(padded, 0.0);
  std::vector<std::complex<double>> spectrum;
  for (const AxisInnovations& axis : now_) {
    for (std::size_t k = 0; k < count; ++k) {
      const double phase = (static_cast<double>(k) + 0.5) / static_cast<double>(count);
      const double hann = 1.0 - std::cos(2.0 * std::numbers::pi * phase);
      const auto i = static_cast<Eigen::Index>(k);
      windowed[k] = hann * axis.value(i) / std::sqrt(axis.variance(i));
    }
    fft.fwd(spectrum, windowed);
    for (Eigen::Index b = 0; b < power.size(); ++b) {
      power(b) += std::norm(spectrum[static_cast<std::size_t>(b)]);
    }
  }
  Eigen::ArrayXd sorted = power;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  power.head(static_cast<Eigen::Index>(static_cast<double>(padded) * series_.interval_s / slowest_period_s)).setZero();
  Eigen::Index peak = 0;
  if (power.maxCoeff(&peak) < line_power / gamma3_median * sorted(sorted.size() / 2)) {
    return std::nullopt;
  }
  return 2.0 * std::numbers::pi * static_cast<double>(peak) / static_cast<double>(padded) / series_.interval_s;
}

// A new oscillation, at first a pure line and as strong as the velocity shows it.
void MotionFit::add_line(double omega) {
  const double T = series_.interval_s;
  const auto count = static_cast<double>(series_.size());
  Eigen::Vector3cd sum = Eigen::Vector3cd::Zero();
  double weight = 0.0;
  for (std::size_t k = 0; k < series_.size(); ++k) {
    const double hann = 1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(k) + 0.5) / count);
    const std::complex<double> turn = std::polar(hann, -omega * T * static_cast<double>(k));
    sum += turn * series_.velocity[k].cast<std::complex<double>>();
    weight += hann;
  }
  // Velocity changes over an interval by omega 2 sin(omega T/2) times the displacement.
  const double gain = std::max(omega * 2.0 * std::sin(0.5 * omega * T), 1e-6);
  const Eigen::Index at = theta_.size();
  theta_.conservativeResize(at + per_line);
  theta_(at) = omega * length_s_;
  theta_(at + 1) = std::log(longest_decay * length_s_);
  for (int axis = 0; axis < 3; ++axis) {
    theta_(at + 2 + axis) = std::log(std::max(std::numbers::sqrt2 * std::abs(sum(axis)) / weight / gain, least_sigma));
  }
  keep_possible(theta_);
  filter_all(theta_, now_);
}

// Where the scoring of all begins: it is slow to make a decay longer by orders of magnitude, so the best of some is
// taken.
void MotionFit::choose_decay() {
  Unknowns theta = theta_;
  Innovations tried;
  double decay_s = longest_decay * length_s_;
  while (decay_s > least_decay_s) {
    for (Eigen::Index at = 1; at < theta.size(); at += per_line) {
      theta(at + 1) = std::log(decay_s);
    }
    filter_all(theta, tried);
    if (log_likelihood(tried) > log_likelihood(now_)) {
      theta_ = theta;
      now_ = tried;
    }
    decay_s *= 0.02;
  }
}

void MotionFit::keep_possible(Unknowns& theta) const {
  theta(0) = std::clamp(theta(0), std::log(least_sigma), 0.0);
  for (Eigen::Index at = 1; at < theta.size(); at += per_line) {
    const double nyquist = std::numbers::pi * static_cast<double>(series_.size());
    theta(at) = std::clamp(theta(at), std::numbers::pi, nyquist - std::numbers::pi);
    theta(at + 1) = std::clamp(theta(at + 1), std::log(least_decay_s), std::log(longest_decay * length_s_));
    for (Eigen::Index k = 2; k < per_line; ++k) {
      theta(at + k) = std::clamp(theta(at + k), std::log(0.1 * least_sigma), std::log(10.0));
    }
  }
}

// (M5): gradient of the log likelihood and Fisher information, by differences of innovations and variances.
void MotionFit::gradient(const std::vector<Eigen::Index>& which, Eigen::VectorXd& g, Eigen::MatrixXd& F) const {
  constexpr double step = 1e-3;
  const auto count = static_cast<Eigen::Index>(series_.size());
  g.setZero();
  F.setZero();
  Eigen::MatrixXd rows(2 * count, g.size());
  AxisInnovations moved;
  for (int axis = 0; axis < 3; ++axis) {
    const AxisInnovations& now = now_[static_cast<std::size_t>(axis)];
    const Eigen::ArrayXd inverse = now.variance.inverse();
    rows.setZero();
    for (Eigen::Index k = 0; k < g.size(); ++k) {
      const Eigen::Index at = which[static_cast<std::size_t>(k)];
      const Eigen::Index within = (at - 1) % per_line;
      if (at > 0 && within >= 2 && within != 2 + axis) {
        continue;  // the size in another axis
      }
      Unknowns theta = theta_;
      theta(at) += step;
      filter_one(theta, axis, moved);
      const Eigen::ArrayXd d_value = (moved.value - now.value) / step;
      const Eigen::ArrayXd d_variance = (moved.variance - now.variance) / step;
      g(k) -= (d_value * now.value * inverse + 0.5 * d_variance * inverse * (1.0 - now.value.square() * inverse)).sum();
      rows.col(k).head(count) = (d_value * inverse.sqrt()).matrix();
      rows.col(k).tail(count) = (d_variance * inverse * std::sqrt(0.5)).matrix();
    }
    F.noalias() += rows.transpose() * rows;
  }
}

// Levenberg-Marquardt on some of the unknowns until the likelihood stands still.
void MotionFit::score(const std::vector<Eigen::Index>& which, int most_steps) {
  const auto unknowns = static_cast<Eigen::Index>(which.size());
  Eigen::VectorXd g(unknowns);
  Eigen::MatrixXd F(unknowns, unknowns);
  double damping = 1e-2;
  Innovations tried;
  for (int step = 0; step < most_steps; ++step) {
    gradient(which, g, F);
    const double before = log_likelihood(now_);
    double gain = 0.0;
    for (int attempt = 0; attempt < 4 && gain <= 0.0; ++attempt) {
      Eigen::MatrixXd damped = F;
      damped.diagonal() += damping * F.diagonal() + Eigen::VectorXd::Constant(unknowns, 0.1);
      const Eigen::VectorXd move = damped.ldlt().solve(g).cwiseMax(-2.0).cwiseMin(2.0);
      Unknowns theta = theta_;
      for (Eigen::Index k = 0; k < unknowns; ++k) {
        theta(which[static_cast<std::size_t>(k)]) += move(k);
      }
      keep_possible(theta);
      filter_all(theta, tried);
      gain = log_likelihood(tried) - before;
      if (gain > 0.0) {
        theta_ = theta;
        std::swap(now_, tried);
        damping = std::max(0.1 * damping, 1e-6);
      } else {
        damping *= 30.0;
      }
    }
    if (gain < enough) {
      return;
    }
  }
}

}  // namespace

ObservationModel fit_motion(const DriftSeries& series, const DriftNoise& noise) {
  return MotionFit(series, noise).fit();
}

}  // namespace selfcal
