#include "estimator/diagnosis/poses/rest_swing.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "estimator/statistics/distributions.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double decimated_hz = 8.0;
constexpr double least_hz = 1.0 / 32.0;

// Means of so many samples: white noise keeps its density, and what is faster than a few Hz is small.
std::vector<double> decimated(const std::vector<std::array<double, 3>>& series, std::size_t axis, std::size_t first,
                              std::size_t last, std::size_t samples) {
  std::vector<double> means;
  for (std::size_t i = first; i + samples <= last; i += samples) {
    double sum = 0.0;
    for (std::size_t k = i; k < i + samples; ++k) {
      sum += series[k][axis];
    }
    means.push_back(sum / static_cast<double>(samples));
  }
  return means;
}

struct Spectrum {
  Eigen::VectorXd density;  // two-sided, raw^2/Hz: the square of an angle random walk
  double bin_hz = 0.0;
  double windows = 0.0;
};

void add_window(Eigen::FFT<double>& fft, const std::vector<double>& values, std::size_t first, Eigen::Index length,
                Spectrum& s) {
  std::vector<double> x(static_cast<std::size_t>(length));
  double mean = 0.0, square = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mean += values[first + k] / static_cast<double>(length);
  }
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double hann =
        0.5 * (1.0 - std::cos(2.0 * M_PI * (static_cast<double>(k) + 0.5) / static_cast<double>(length)));
    x[k] = (values[first + k] - mean) * hann;
    square += hann * hann;
  }
  std::vector<std::complex<double>> lines;
  fft.fwd(lines, x);
  for (Eigen::Index k = 0; k < s.density.size(); ++k) {
    s.density(k) += std::norm(lines[static_cast<std::size_t>(k)]) / square;
  }
  s.windows += 1.0;
}

std::optional<Spectrum> spectrum_of(const std::vector<std::array<double, 3>>& series, std::size_t axis, double rate_hz,
                                    const std::vector<Pose>& poses) {
  const auto samples = static_cast<std::size_t>(std::max(1.0, std::floor(rate_hz / decimated_hz)));
  const double rate = rate_hz / static_cast<double>(samples);
  constexpr double longest_s = 128.0, shortest_s = 32.0;
  std::vector<std::vector<double>> stretches;
  std::size_t most = 0;
  for (const Pose& p : poses) {
    for (const auto& [first, last] : p.quiet) {
      stretches.push_back(decimated(series, axis, first, last, samples));
      most = std::max(most, stretches.back().size());
    }
  }
  const auto length = std::min(static_cast<Eigen::Index>(longest_s * rate), static_cast<Eigen::Index>(most));
  if (static_cast<double>(length) < shortest_s * rate) {
    return std::nullopt;
  }
  Spectrum s{Eigen::VectorXd::Zero(length / 2), rate / static_cast<double>(length), 0.0};
  Eigen::FFT<double> fft;
  for (const std::vector<double>& values : stretches) {
    const auto whole = static_cast<std::size_t>(length);
    for (std::size_t first = 0; first + whole <= values.size(); first += (whole + 1) / 2) {
      add_window(fft, values, first, length, s);
    }
  }
  s.density /= s.windows * rate;
  return s;
}

// Windows overlap by a half: of Hann's 1.9 of two are free (Welch 1967).
double freedom(const Spectrum& s) { return 2.0 * std::max(1.0, 0.95 * s.windows); }

// Mean of bins that are chi-squared, by their median.
double level_of(const Spectrum& s, double from_hz, double to_hz) {
  const auto bin = [&](double f) { return static_cast<Eigen::Index>(std::lround(f / s.bin_hz)); };
  const Eigen::Index first = std::max<Eigen::Index>(2, bin(from_hz)), last = std::min(s.density.size(), bin(to_hz));
  constexpr double enough = 24.0;  // bins of one window
  if (last <= first || static_cast<double>(last - first) * s.windows < enough) {
    return HUGE_VAL;
  }
  const double of_median = std::pow(1.0 - 2.0 / (9.0 * freedom(s)), 3.0);
  return median({s.density.data() + first, s.density.data() + last}) / of_median;
}

}  // namespace

std::optional<Swing> find_swing(const std::vector<std::array<double, 3>>& series, std::size_t axis, double rate_hz,
                                const std::vector<Pose>& poses) {
  const std::optional<Spectrum> s = spectrum_of(series, axis, rate_hz, poses);
  if (!s) {
    return std::nullopt;
  }
  double white = HUGE_VAL;
  constexpr double octave = 2.0;
  for (const double from_hz : {1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0, 1.0}) {
    white = std::min(white, level_of(*s, from_hz, octave * from_hz));
  }
  const auto first = static_cast<Eigen::Index>(std::ceil(std::max(least_hz, 3.0 * s->bin_hz) / s->bin_hz));
  if (!(white > 0.0) || !std::isfinite(white) || first + 1 >= s->density.size()) {
    return std::nullopt;
  }
  // Against the octave about it, so that slow noise is no line.
  Eigen::Index peak = -1;
  double most = 0.0;
  const double bins = static_cast<double>(s->density.size() - first);
  for (Eigen::Index k = first; k < s->density.size(); ++k) {
    const double f = static_cast<double>(k) * s->bin_hz;
    const double around = std::max(white, level_of(*s, f / M_SQRT2, f * M_SQRT2));
    if (std::isfinite(around) && s->density(k) / around > most) {
      most = s->density(k) / around;
      peak = k;
    }
  }
  const double log_p = log_chi_squared_tail(most * freedom(*s), freedom(*s)) + std::log(bins);
  constexpr double by_chance = -13.8;  // ln 1e-6
  if (peak < 0 || log_p > by_chance) {
    return std::nullopt;
  }
  const double around = s->density(peak) / most;
  constexpr double of_it = 4.0;
  Eigen::Index low = peak, high = peak;
  while (low > first && s->density(low - 1) > of_it * around) {
    --low;
  }
  while (high + 1 < s->density.size() && s->density(high + 1) > of_it * around) {
    ++high;
  }
  double power = 0.0, moment = 0.0;
  for (Eigen::Index k = low; k <= high; ++k) {
    power += s->density(k) - around;
    moment += (s->density(k) - around) * static_cast<double>(k);
  }
  // Both sides of the spectrum; a sine has half its amplitude's square.
  return Swing{moment / power * s->bin_hz, std::sqrt(2.0 * 2.0 * power * s->bin_hz), std::sqrt(white)};
}

}  // namespace selfcal::diagnosis
