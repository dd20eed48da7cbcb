#include "estimator/diagnosis/noise/coherent_lines.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double longest_s = 200.0, shortest_s = 20.0;
constexpr double lowest_hz = 0.1;  // below it what is slow is spectrum
constexpr Eigen::Index lowest_bin = 4;
constexpr double stands_out = 10.0;
constexpr Eigen::Index own = 2, around = 24;  // bins to either side: of a line, the background

Eigen::VectorXd rate_of(const ImuData& data, int axis, std::size_t first, std::size_t n) {
  const auto& increments = axis < 3 ? data.delta_theta : data.delta_v;
  Eigen::VectorXd rate(static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    rate(static_cast<Eigen::Index>(i)) =
        increments[first + i][static_cast<std::size_t>(axis % 3)] * data.sample_rate_hz;
  }
  return rate;
}

// Of pieces of n samples, one a stretch that is long enough: what each bin adds to the mean square, bins 0 to n/2 - 1.
std::vector<double> mean_periodogram(const ImuData& data, const std::vector<Segment>& stretches, int axis,
                                     std::size_t n) {
  constexpr double of_window = 1.5;  // mean square of Hann's weights
  std::vector<double> power(n / 2, 0.0);
  double pieces = 0.0;
  for (const Segment& s : stretches) {
    if (s.last - s.first < n) {
      continue;
    }
    Eigen::VectorXd x = rate_of(data, axis, s.first, n);
    x.array() -= x.mean();
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      x(i) *= 1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    }
    Eigen::VectorXcd spectrum;
    Eigen::FFT<double>().fwd(spectrum, x);
    for (std::size_t k = 0; k < power.size(); ++k) {
      power[k] += std::norm(spectrum(static_cast<Eigen::Index>(k)));
    }
    pieces += 1.0;
  }
  for (double& p : power) {
    p *= 2.0 / (of_window * std::max(1.0, pieces) * static_cast<double>(n) * static_cast<double>(n));
  }
  return power;
}

struct Peak {
  double hz = 0.0;
  double square = 0.0;  // mean, of all that stands in its bins
};

std::vector<Peak> peaks_of(const std::vector<double>& power, double bin_hz) {
  constexpr double narrow =
      0.1;  // of the peak, two bins away on one side at least: another line may stand on the other
  // What comes from white noise of the integral grows as f^2: bins are compared as densities of velocity or angle.
  std::vector<double> density(power.size(), 0.0);
  for (std::size_t k = 1; k < power.size(); ++k) {
    density[k] = power[k] / static_cast<double>(k * k);
  }
  std::vector<Peak> found;
  const Eigen::Index first = std::max(lowest_bin, static_cast<Eigen::Index>(lowest_hz / bin_hz));
  for (Eigen::Index k = first; k + around < std::ssize(density); ++k) {
    const auto at = density.begin() + k;
    const double background =
        median(std::vector<double>(density.begin() + std::max(first, k - around), at + around + 1));
    const bool peak = *at >= *std::max_element(at - own, at + own + 1);
    if (!peak || *at < stands_out * background || std::min(*(at - own), *(at + own)) > narrow * *at) {
      continue;
    }
    // Hann: the ratio of the neighbours tells where between two bins the peak lies.
    const bool right = *(at + 1) > *(at - 1);
    const double side = std::sqrt(std::max(*(at + 1), *(at - 1)) / *at);
    const double offset = std::clamp((2.0 * side - 1.0) / (1.0 + side), 0.0, 0.5);
    double square = 0.0;
    for (Eigen::Index j = k - 1; j <= k + 1; ++j) {
      square += power[static_cast<std::size_t>(j)];
    }
    found.push_back({(static_cast<double>(k) + (right ? offset : -offset)) * bin_hz, square});
  }
  return found;
}

Eigen::MatrixXd waves(const std::vector<double>& hz, Eigen::Index n, double rate_hz) {
  Eigen::MatrixXd design(n, static_cast<Eigen::Index>(2 * hz.size()));
  for (std::size_t l = 0; l < hz.size(); ++l) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const double phase = 2.0 * std::numbers::pi * hz[l] * static_cast<double>(i) / rate_hz;
      design(i, static_cast<Eigen::Index>(2 * l)) = std::cos(phase);
      design(i, static_cast<Eigen::Index>(2 * l) + 1) = std::sin(phase);
    }
  }
  return design;
}

// Fits sines of these frequencies to each stretch, with phases and sizes of its own there, and hands what they make to `each`. Mean squares.
template <typename Each>
std::vector<double> fitted_squares(const ImuData& data, const std::vector<Segment>& stretches, int axis,
                                   const std::vector<double>& hz, const Each& each) {
  std::vector<double> square(hz.size(), 0.0);
  double samples = 0.0;
  for (const Segment& s : stretches) {
    const std::size_t n = s.last - s.first;
    Eigen::VectorXd rate = rate_of(data, axis, s.first, n);
    rate.array() -= rate.mean();
    const Eigen::MatrixXd design = waves(hz, rate.size(), data.sample_rate_hz);
    if (rate.size() <= 4 * design.cols()) {
      continue;
    }
    const Eigen::MatrixXd normal = design.transpose() * design;
    const Eigen::VectorXd size = normal.ldlt().solve(design.transpose() * rate);
    each(s, Eigen::VectorXd(design * size));
    for (std::size_t l = 0; l < hz.size(); ++l) {
      square[l] += 0.5 * static_cast<double>(n) * size.segment<2>(static_cast<Eigen::Index>(2 * l)).squaredNorm();
    }
    samples += static_cast<double>(n);
  }
  for (double& s : square) {
    s /= std::max(1.0, samples);
  }
  return square;
}

// Those that one frequency makes: two that stand in one bin, in different dwells, are none.
std::vector<double> coherent_of(const ImuData& data, const std::vector<Segment>& stretches, int axis,
                                const std::vector<Peak>& peaks) {
  constexpr double most_of_it = 0.9;
  std::vector<double> all, kept;
  for (const Peak& p : peaks) {
    all.push_back(p.hz);
  }
  const std::vector<double> square =
      fitted_squares(data, stretches, axis, all, [](const Segment& /*stretch*/, const Eigen::VectorXd& /*wave*/) {});
  for (std::size_t l = 0; l < peaks.size(); ++l) {
    if (square[l] > most_of_it * peaks[l].square) {
      kept.push_back(peaks[l].hz);
    }
  }
  return kept;
}

std::vector<CoherentLine> taken_out(const ImuData& data, const std::vector<Segment>& stretches, int axis,
                                    const std::vector<double>& hz, AngleVelocity& increments) {
  const auto subtract = [&](const Segment& s, const Eigen::VectorXd& wave) {
    for (std::size_t i = s.first; i < s.last; ++i) {
      increments[i][static_cast<std::size_t>(axis % 3)] -=
          wave(static_cast<Eigen::Index>(i - s.first)) / data.sample_rate_hz;
    }
  };
  const std::vector<double> square = fitted_squares(data, stretches, axis, hz, subtract);
  std::vector<CoherentLine> lines;
  for (std::size_t l = 0; l < hz.size(); ++l) {
    const double x = std::numbers::pi * hz[l] / data.sample_rate_hz;  // a sample's mean has sin x / x of it
    lines.push_back({axis, hz[l], std::sqrt(2.0 * square[l]) * x / std::sin(x)});
  }
  return lines;
}

}  // namespace

CoherentLines coherent_lines(const ImuData& data, const std::vector<Segment>& stretches) {
  AngleVelocity theta(data.delta_theta.begin(), data.delta_theta.end());
  AngleVelocity velocity(data.delta_v.begin(), data.delta_v.end());
  std::vector<std::size_t> sizes;
  sizes.reserve(stretches.size());
  for (const Segment& s : stretches) {
    sizes.push_back(s.last - s.first);
  }
  std::sort(sizes.begin(), sizes.end());
  const std::size_t n = sizes.empty() ? 0 : sizes[sizes.size() / 2] / 2 * 2;
  const double length_s = static_cast<double>(n) / data.sample_rate_hz;
  CoherentLines found;
  if (length_s < shortest_s || length_s > longest_s) {
    found.without = CorrectedRecording(data);
    return found;
  }
  for (int axis = 0; axis < 6; ++axis) {
    const std::vector<Peak> peaks = peaks_of(mean_periodogram(data, stretches, axis, n), 1.0 / length_s);
    const std::vector<double> hz = coherent_of(data, stretches, axis, peaks);
    const std::vector<CoherentLine> lines =
        hz.empty() ? std::vector<CoherentLine>{} : taken_out(data, stretches, axis, hz, axis < 3 ? theta : velocity);
    found.lines.insert(found.lines.end(), lines.begin(), lines.end());
  }
  found.without = CorrectedRecording(data, std::move(theta), std::move(velocity));
  return found;
}

}  // namespace selfcal::diagnosis
