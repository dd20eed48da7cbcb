#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "tools/report/overlay_noise.hpp"
#include "tools/report/overlay_parts.hpp"

namespace selfcal::report {
namespace {

// A power of two that fits into the median range, of 40 s at most.
std::size_t piece_length(const std::vector<Range>& ranges, double rate_hz) {
  std::vector<std::size_t> sizes;
  for (const Range& r : ranges) {
    sizes.push_back(r.size());
  }
  if (sizes.empty()) {
    return 0;
  }
  std::sort(sizes.begin(), sizes.end());
  const double longest = std::min(40.0 * rate_hz, static_cast<double>(sizes[sizes.size() / 2]));
  return static_cast<std::size_t>(std::exp2(std::floor(std::log2(longest))));
}

// Bins [first, last) of a Hann window: neighbours share 4/9 of their variance, those beyond 1/36.
double freedom_of(int pieces, double bins) {
  const double shared = 1.0 + 2.0 * (4.0 / 9.0) * (1.0 - 1.0 / bins) + 2.0 / 36.0 * std::max(0.0, 1.0 - 2.0 / bins);
  return 2.0 * pieces * bins / shared;
}

// Edges about evenly spaced in the logarithm, with four bins and more, from the third bin on.
std::vector<std::size_t> groups_of(std::size_t bins) {
  constexpr double per_decade = 8.0;
  constexpr std::size_t least = 4;
  std::vector<std::size_t> edges = {3};
  while (edges.back() + least < bins) {
    const auto next = static_cast<std::size_t>(static_cast<double>(edges.back()) * std::pow(10.0, 1.0 / per_decade));
    edges.push_back(std::min(bins, std::max(edges.back() + least, next)));
  }
  return edges;
}

struct Spectrum {
  std::vector<Parts> groups;  // densities per Hz, one-sided; the mean of a group's bins in each piece
  int pieces = 0;
};

// A piece of n samples less its mean and slope, under a Hann window.
class HannPiece {
 public:
  explicit HannPiece(std::size_t n) : hann_(n), piece_(n) {
    for (std::size_t i = 0; i < n; ++i) {
      hann_[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    }
  }
  // |DFT|^2 of the samples from `at` on.
  const std::vector<double>& power(const ImuData& data, std::size_t sensor, std::size_t at) {
    const auto n = static_cast<double>(piece_.size());
    const double middle = 0.5 * (n - 1.0), spread = n * (n * n - 1.0) / 12.0;
    double mean = 0.0, slope = 0.0;
    for (std::size_t i = 0; i < piece_.size(); ++i) {
      const double x = increment(data, sensor, at + i);
      mean += x / n;
      slope += x * (static_cast<double>(i) - middle) / spread;
    }
    for (std::size_t i = 0; i < piece_.size(); ++i) {
      piece_[i] = hann_[i] * (increment(data, sensor, at + i) - mean - slope * (static_cast<double>(i) - middle));
    }
    fft_.fwd(lines_, piece_);
    power_.resize(piece_.size() / 2);
    for (std::size_t k = 0; k < power_.size(); ++k) {
      power_[k] = std::norm(lines_[k]);
    }
    return power_;
  }

 private:
  std::vector<double> hann_, piece_, power_;
  std::vector<std::complex<double>> lines_;
  Eigen::FFT<double> fft_;
};

Spectrum spectrum_of(const ImuData& data, std::size_t sensor, const std::vector<Range>& ranges, std::size_t n,
                     const std::vector<std::size_t>& edges) {
  Spectrum s{std::vector<Parts>(edges.size() - 1, Parts(ranges)), 0};
  HannPiece piece(n);
  // Mean square of the window is 3/8; rates are increments times the sampling rate.
  const double scale = data.sample_rate_hz / (0.375 * static_cast<double>(n)) * 2.0;
  for (std::size_t number = 0; number < ranges.size(); ++number) {
    const Range& r = ranges[number];
    for (std::size_t at = r.first; at + n <= r.last; at += n) {
      const std::vector<double>& power = piece.power(data, sensor, at);
      for (std::size_t g = 0; g + 1 < edges.size(); ++g) {
        double sum = 0.0;
        for (std::size_t k = edges[g]; k < edges[g + 1]; ++k) {
          sum += scale * power[k];
        }
        s.groups[g].add(number, r, at, sum / static_cast<double>(edges[g + 1] - edges[g]));
      }
      ++s.pieces;
    }
  }
  return s;
}

}  // namespace

std::vector<OverlayCurve> overlay_spectra(const ImuData& recording, const ImuData& simulation) {
  const std::vector<Range> own = quiet(recording), others = quiet(simulation);
  const std::size_t n =
      std::min(piece_length(own, recording.sample_rate_hz), piece_length(others, recording.sample_rate_hz));
  std::vector<OverlayCurve> curves;
  constexpr std::size_t shortest = 64;
  for (std::size_t sensor = 0; sensor < sensor_count && n >= shortest; ++sensor) {
    const std::vector<std::size_t> edges = groups_of(n / 2);
    const Spectrum a = spectrum_of(recording, sensor, own, n, edges),
                   b = spectrum_of(simulation, sensor, others, n, edges);
    OverlayCurve curve{OverlayKind::spectrum,
                       "spectrum-" + std::to_string(sensor),
                       sensor_name(sensor),
                       "frequency",
                       "Hz",
                       "density",
                       sensor < 3 ? "deg/h/√Hz" : "ug/√Hz",
                       true,
                       {}};
    for (std::size_t g = 0; g + 1 < edges.size(); ++g) {
      const auto bins = static_cast<double>(edges[g + 1] - edges[g]);
      const double hz =
          recording.sample_rate_hz / static_cast<double>(n) * 0.5 * static_cast<double>(edges[g] + edges[g + 1] - 1);
      const std::vector<Part>&of_a = a.groups[g].all(), &of_b = b.groups[g].all();
      OverlayPoint p = ratio_point(hz, mean_of(of_a), mean_of(of_b), freedom_of(a.pieces, bins),
                                   freedom_of(b.pieces, bins), scatter_of(of_a, of_b));
      for (double* value : {&p.recording, &p.simulation, &p.low, &p.high}) {
        *value = std::sqrt(*value) / page_unit(sensor);
      }
      curve.points.push_back(p);
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

}  // namespace selfcal::report
