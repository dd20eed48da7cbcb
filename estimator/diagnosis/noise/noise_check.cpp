#include "estimator/diagnosis/noise/noise_check.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "estimator/diagnosis/noise/quantum_beat.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double margin_s = 5.0;
constexpr double lowest_hz = 0.25;  // slower: drifts of all kinds
constexpr int most_pieces_per_dwell = 8;

int pieces_of(const Segment& s, Eigen::Index length, double rate_hz) {
  const auto margin = static_cast<std::ptrdiff_t>(margin_s * rate_hz);
  const std::ptrdiff_t inside = static_cast<std::ptrdiff_t>(s.last - s.first) - 2 * margin;
  return s.rotation ? 0 : static_cast<int>(std::clamp<std::ptrdiff_t>(inside / length, 0, most_pieces_per_dwell));
}

// Samples of a piece: the power of two next below 21 s, at most 2048; a dwell of a minute then holds two or more. Shorter
// where the dwells do not hold enough: chance is stated by the number of pieces and bins, only slow lines are then not seen.
Eigen::Index piece_length(double rate_hz, const std::vector<Segment>& segments) {
  constexpr double longest_s = 21.0;
  constexpr Eigen::Index shortest = 256;
  const auto total = [&](Eigen::Index length) {
    return std::accumulate(segments.begin(), segments.end(), 0,
                           [&](int sum, const Segment& s) { return sum + pieces_of(s, length, rate_hz); });
  };
  Eigen::Index length = 2048;
  while (length > shortest &&
         (static_cast<double>(length) > longest_s * rate_hz || total(length) < enough_noise_pieces)) {
    length /= 2;
  }
  return length;
}

// A median over dwells tells a line from a knock, and a mean of eight pieces of a dwell of half an hour wastes it: where there
// are few dwells the long ones are cut.
std::vector<Segment> cut_where_few(const std::vector<Segment>& segments, double rate_hz) {
  constexpr std::ptrdiff_t few = 8;
  constexpr double part_s = 80.0;  // three pieces and the margins
  const auto dwells = std::count_if(segments.begin(), segments.end(), [](const Segment& s) { return !s.rotation; });
  if (dwells >= few) {
    return segments;
  }
  const auto part = static_cast<std::size_t>(part_s * rate_hz);
  std::vector<Segment> cut;
  for (const Segment& s : segments) {
    if (s.rotation || s.last - s.first < 2 * part) {
      cut.push_back(s);
      continue;
    }
    for (std::size_t first = s.first; first + part <= s.last; first += part) {
      Segment piece = s;
      piece.first = first;
      piece.last = first + part;
      cut.push_back(piece);
    }
  }
  return cut;
}

using Spectrum = Eigen::ArrayXd;

struct DwellSpectra {
  std::vector<Spectrum> dwells;  // mean of each
  std::vector<int> pieces;
  std::vector<CountedRate> counted;  // from piece to piece
};

DwellSpectra spectra(const ImuData& data, const std::vector<Segment>& segments, std::size_t axis, Eigen::Index piece,
                     const Quanta& quanta) {
  DwellSpectra result;
  const double dt = 1.0 / data.sample_rate_hz;
  Eigen::VectorXd window(piece);
  for (Eigen::Index i = 0; i < piece; ++i) {
    window(i) = 1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(piece));
  }
  const double scale = dt / window.squaredNorm();
  Eigen::FFT<double> fft;
  Eigen::VectorXd x(piece);
  Eigen::VectorXcd transform;
  const auto margin = static_cast<std::size_t>(margin_s * data.sample_rate_hz);
  for (const Segment& s : segments) {
    Spectrum sum = Spectrum::Zero(piece / 2);
    const int count = pieces_of(s, piece, data.sample_rate_hz);
    std::vector<double> rates;
    for (int k = 0; k < count; ++k) {
      const std::size_t first = s.first + margin + static_cast<std::size_t>(k * piece);
      for (Eigen::Index i = 0; i < piece; ++i) {
        const std::size_t at = first + static_cast<std::size_t>(i);
        x(i) = (axis < 3 ? data.delta_theta[at][axis] : data.delta_v[at][axis - 3]) / dt;
      }
      rates.push_back(x.mean());
      x.array() -= rates.back();
      x = x.cwiseProduct(window);
      fft.fwd(transform, x);
      sum += transform.head(piece / 2).array().abs2() * scale;
    }
    if (count > 0) {
      result.dwells.emplace_back(sum / count);
      result.pieces.push_back(count);
      const auto [least, most] = std::minmax_element(rates.begin(), rates.end());
      result.counted.push_back({0.5 * (*least + *most), 0.5 * (*most - *least),
                                axis < 3 ? quanta.angle : quanta.velocity, data.sample_rate_hz});
    }
  }
  return result;
}

// density = N^2 + Q^2 4 sin^2(pi f D)/D, weighted by the model itself; bins far above it are left out.
AxisNoise fit_noise(const Spectrum& density, int pieces, double dt) {
  const auto piece = static_cast<double>(2 * density.size());
  const auto first = static_cast<Eigen::Index>(std::ceil(lowest_hz * piece * dt));
  Spectrum shape(density.size());
  for (Eigen::Index b = 0; b < density.size(); ++b) {
    const double sine = std::sin(std::numbers::pi * static_cast<double>(b) / piece);
    shape(b) = 4.0 * sine * sine / dt;
  }
  double white = density.segment(first, 20).mean();
  double angle = 0.0;
  Eigen::Matrix2d normal;
  for (int round = 0; round < 30; ++round) {
    normal.setZero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (Eigen::Index b = first; b < density.size(); ++b) {
      const double model = white + angle * shape(b);
      if (round > 4 && density(b) > 2.0 * model) {
        continue;
      }
      const Eigen::Vector2d row(1.0 / model, shape(b) / model);
      normal += row * row.transpose();
      right += row * density(b) / model;
    }
    const Eigen::Vector2d fit = normal.inverse() * right;
    angle = std::max(0.0, fit(1));
    white = std::max(angle > 0.0 ? fit(0) : right(0) / normal(0, 0), 1e-3 * white);
  }
  AxisNoise noise;
  noise.white_asd = std::sqrt(white);
  // A mean of `pieces` periodograms scatters by 1/sqrt(pieces); Hann correlates neighbouring bins: 1.5 times that.
  noise.white_sigma = 0.5 / noise.white_asd * std::sqrt(1.5 * normal.inverse()(0, 0) / pieces);
  noise.increment_sigma = std::sqrt(angle);
  noise.increment_variance_sigma = std::sqrt(1.5 * normal.inverse()(1, 1) / pieces);
  return noise;
}

// A sinusoid of amplitude a gives a^2 T/6 at the middle of Hann's bin (gain 2/3 of a T/4).
double amplitude_of(double density, double piece_s) { return std::sqrt(6.0 * density / piece_s); }

// Of a bin its density in each dwell where the beat of the quantum, half as strong or more, is not.
std::vector<double> without_beats(const DwellSpectra& s, Eigen::Index bin, double piece_s) {
  constexpr double half = 0.5, bins_wide = 2.0;
  std::vector<double> values;
  for (std::size_t d = 0; d < s.dwells.size(); ++d) {
    const double density = s.dwells[d](bin);
    if (!beat_of_quantum(s.counted[d], static_cast<double>(bin) / piece_s, half * amplitude_of(density, piece_s),
                         bins_wide / piece_s)) {
      values.push_back(density);
    }
  }
  return values;
}

void find_lines(const DwellSpectra& s, int axis, double rate_hz, std::vector<VibrationLine>& lines) {
  const std::size_t dwells = s.dwells.size();
  const auto bins = s.dwells.front().size();
  const auto piece = static_cast<double>(2 * bins);
  const auto first = static_cast<Eigen::Index>(std::ceil(2.0 * lowest_hz * piece / rate_hz));
  Spectrum middle = Spectrum::Zero(bins);  // median over the dwells
  std::vector<std::size_t> told(static_cast<std::size_t>(bins));
  for (Eigen::Index b = 0; b < bins; ++b) {
    std::vector<double> values = without_beats(s, b, piece / rate_hz);
    told[static_cast<std::size_t>(b)] = values.size();
    if (2 * values.size() >= dwells) {
      const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), at, values.end());
      middle(b) = *at;
    }
  }
  // Spread of the median: 1.25 sigma/sqrt(dwells), sigma = 1/sqrt(pieces) of the mean; its tail taken as normal, and
  // so the limit below as 9 of them. The background is the median of the neighbourhood.
  constexpr Eigen::Index half = 20;
  for (Eigen::Index b = std::max(first, half); b + half < bins; ++b) {
    if (!(middle(b) > 0.0)) {
      continue;  // no dwell tells
    }
    std::vector<double> around(middle.data() + b - half, middle.data() + b + half + 1);
    std::erase(around, 0.0);
    std::nth_element(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2), around.end());
    const double background = around[around.size() / 2];
    const double spread = 1.25 / std::sqrt(static_cast<double>(told[static_cast<std::size_t>(b)]) * s.pieces.front());
    const double excess = middle(b) / background - 1.0;
    const bool peak = middle(b) >= middle(b - 1) && middle(b) > middle(b + 1);
    if (peak && excess > 9.0 * spread && excess > 0.8) {
      const double z = excess / spread;
      const double amplitude = amplitude_of(middle(b) - background, piece / rate_hz);
      lines.push_back({axis, static_cast<double>(b) * rate_hz / piece, amplitude,
                       log_corrected(log_chi_squared_tail(z * z / 2.0, 1.0), 6.0 * static_cast<double>(bins))});
    }
  }
}

}  // namespace

NoiseCheck check_noise(const ImuData& data, const std::vector<Segment>& all, const Quanta& quanta) {
  const std::vector<Segment> segments = cut_where_few(all, data.sample_rate_hz);
  NoiseCheck check;
  const Eigen::Index length = piece_length(data.sample_rate_hz, segments);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const DwellSpectra s = spectra(data, segments, axis, length, quanta);
    Spectrum mean = Spectrum::Zero(length / 2);
    check.pieces = 0;
    for (std::size_t d = 0; d < s.dwells.size(); ++d) {
      mean += s.dwells[d] * s.pieces[d];
      check.pieces += s.pieces[d];
    }
    if (check.pieces < enough_noise_pieces) {
      return check;
    }
    check.axes[axis] = fit_noise(mean / check.pieces, check.pieces, 1.0 / data.sample_rate_hz);
    find_lines(s, static_cast<int>(axis), data.sample_rate_hz, check.lines);
  }
  return check;
}

}  // namespace selfcal::diagnosis
