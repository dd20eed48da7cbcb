#include "estimator/diagnosis/noise/band_loudness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/FFT>

namespace selfcal::diagnosis {
namespace {

using Complex = std::complex<double>;

// A second of people tells octaves above 1 Hz apart; below, what a band tells of time is what its width allows.
constexpr std::array<double, 7> edges_hz = {0.03, 0.1, 0.3, 0.6, 1.2, 2.5, 5.0};
constexpr double shortest_s = 1.0;

// Bands fade into each other, from the edge over `fade` to `fade` times it, so that what is loud rings for no longer than it must.
constexpr double fade = 1.4;

// Share of a band's amplitude above an edge; squares of both sides add up to one. Edge 0: all.
double above_edge(double hz, double edge_hz) {
  if (edge_hz <= 0.0) {
    return 1.0;
  }
  const double at = 0.5 + 0.5 * std::log(std::max(hz, 1e-9) / edge_hz) / std::log(fade);
  const double s = std::clamp(at, 0.0, 1.0);
  return std::sin(0.5 * std::numbers::pi * s * s * (3.0 - 2.0 * s));
}

// Share of each line's amplitude that a band has.
std::vector<double> shares_of(std::size_t lines, double line_hz, double low_hz, double high_hz) {
  const bool last = high_hz >= line_hz * static_cast<double>(lines - 1);
  std::vector<double> shares(lines, 0.0);
  for (std::size_t k = 1; k + 1 < lines; ++k) {
    const double hz = static_cast<double>(k) * line_hz, above = above_edge(hz, high_hz);
    shares[k] = above_edge(hz, low_hz) * (last ? 1.0 : std::sqrt(std::max(0.0, 1.0 - above * above)));
  }
  return shares;
}

// Of the noise of this band: its power is known to one over the square root of this and the time.
double width_of(const std::vector<double>& shares, double line_hz) {
  double square = 0.0, fourth = 0.0;
  for (const double s : shares) {
    square += s * s;
    fourth += s * s * s * s;
  }
  return line_hz * square * square / fourth;
}

// The series of a band, the first half of it.
std::vector<double> band_of(const std::vector<Complex>& lines, const std::vector<double>& shares) {
  const std::size_t n = lines.size() - 1;
  std::vector<Complex> both(2 * n, 0.0), values;
  for (std::size_t k = 1; k < n; ++k) {
    both[k] = lines[k] * shares[k];
    both[2 * n - k] = std::conj(both[k]);
  }
  Eigen::FFT<double>().inv(values, both);
  std::vector<double> band(n);
  std::transform(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n), band.begin(),
                 [](const Complex& value) { return value.real(); });
  return band;
}

// Means of the squares under Hann windows of `reach` samples to either side, every `step`.
std::vector<double> smoothed_squares(const std::vector<double>& band, std::size_t reach, std::size_t step) {
  std::vector<double> window(2 * reach + 1), means;
  for (std::size_t i = 0; i < window.size(); ++i) {
    const double turn = std::numbers::pi * (static_cast<double>(i) + 1.0) / static_cast<double>(reach + 1);
    window[i] = 0.5 - 0.5 * std::cos(turn);
  }
  for (std::size_t middle = 0; middle < band.size() + step; middle += step) {
    double sum = 0.0, weight = 0.0;
    const std::size_t first = middle > reach ? middle - reach : 0;
    for (std::size_t i = first; i < std::min(band.size(), middle + reach + 1); ++i) {
      const double w = window[i + reach - middle];
      sum += w * band[i] * band[i];
      weight += w;
    }
    if (weight > 0.0) {
      means.push_back(sum / weight);
    }
  }
  return means;
}

// Where a series turns back its slope has a step, which rings: there its neighbours' power stands.
void level_ends(std::vector<double>& power, std::size_t ringing) {
  for (std::size_t k = 0; k < ringing; ++k) {
    power[k] = power[ringing];
    power[power.size() - 1 - k] = power[power.size() - 1 - ringing];
  }
}

// Mean square over the square of the mean, of the powers to this exponent.
double spread(const std::vector<double>& power, double exponent) {
  double mean = 0.0, square = 0.0;
  for (const double p : power) {
    const double value = std::pow(p, exponent);
    mean += value;
    square += value * value;
  }
  return square * static_cast<double>(power.size()) / (mean * mean);
}

// Powers of mean 1 with the spread that is theirs: chance widens it. Their order and that a quiet time is quiet stay.
std::vector<double> less_chance(std::vector<double> power, double of_chance) {
  constexpr double least = 0.1;  // what spectra tell anyway
  constexpr int halvings = 30;
  if (!(*std::max_element(power.begin(), power.end()) > 0.0)) {
    return {1.0};
  }
  const double own = spread(power, 1.0) / (1.0 + of_chance);
  if (own < 1.0 + least) {
    return {1.0};
  }
  double low = 0.0, high = 1.0;
  for (int k = 0; k < halvings; ++k) {
    const double middle = 0.5 * (low + high);
    (spread(power, middle) < own ? low : high) = middle;
  }
  double mean = 0.0;
  for (double& p : power) {
    p = std::pow(p, high);
    mean += p / static_cast<double>(power.size());
  }
  for (double& p : power) {
    p /= mean;
  }
  return power;
}

}  // namespace

std::size_t quick_length(std::size_t available) {
  std::size_t best = 1;
  for (std::size_t fives = 1; fives <= available; fives *= 5) {
    for (std::size_t threes = fives; threes <= available; threes *= 3) {
      std::size_t length = threes;
      while (2 * length <= available) {
        length *= 2;
      }
      best = std::max(best, length);
    }
  }
  return best;
}

std::vector<Complex> mirrored_lines(const std::vector<double>& series) {
  std::vector<double> both(series);
  both.insert(both.end(), series.rbegin(), series.rend());
  std::vector<Complex> lines;
  Eigen::FFT<double>().fwd(lines, both);
  lines.resize(series.size() + 1);
  return lines;
}

std::vector<BandLoudness> loudness_of_bands(const std::vector<Complex>& whitened, double rate_hz) {
  const std::size_t n = whitened.size() - 1;
  const double line_hz = 0.5 * rate_hz / static_cast<double>(n);
  std::vector<BandLoudness> bands;
  double low_hz = 0.0;
  bool steady = true;
  for (std::size_t k = 0; k <= edges_hz.size() && low_hz < 0.5 * rate_hz; ++k) {
    const double high_hz = k < edges_hz.size() ? std::min(edges_hz.at(k), 0.5 * rate_hz) : 0.5 * rate_hz;
    const double reach_s = std::max(shortest_s, 1.0 / (high_hz - low_hz));
    const auto reach = static_cast<std::size_t>(reach_s * rate_hz), step = std::max<std::size_t>(1, reach / 2);
    bands.push_back({high_hz, static_cast<double>(step) / rate_hz, {1.0}});
    if (constexpr std::size_t enough = 16; reach < n / enough) {
      const std::vector<double> shares = shares_of(n + 1, line_hz, low_hz, high_hz);
      const double of_chance = 0.75 / (reach_s * width_of(shares, line_hz));
      std::vector<double> power = smoothed_squares(band_of(whitened, shares), reach, step);
      level_ends(power, 2 * reach / step);
      bands.back().power = less_chance(std::move(power), of_chance);
    }
    steady = steady && bands.back().power.size() == 1;
    low_hz = high_hz;
  }
  return steady ? std::vector<BandLoudness>{} : bands;
}

}  // namespace selfcal::diagnosis
