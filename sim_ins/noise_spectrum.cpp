#include "sim_ins/noise_spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <unsupported/Eigen/FFT>
#include <utility>

namespace selfcal::sim {
namespace {

constexpr std::uint64_t first_stream = 32;  // of the seed; a channel each

std::uint64_t stream_of(const NoiseSpectrum& spectrum) {
  return first_stream + static_cast<std::uint64_t>(spectrum.channel);
}

double narrowest(const NoiseSpectrum& spectrum) {
  double width = std::numeric_limits<double>::max();
  for (std::size_t k = 0; k + 1 < spectrum.edges_hz.size(); ++k) {
    width = std::min(width, spectrum.edges_hz[k + 1] - spectrum.edges_hz[k]);
  }
  return width;
}

// The band that holds a frequency; none outside the table.
std::optional<std::size_t> band_at(const NoiseSpectrum& spectrum, double hz) {
  const auto above = std::upper_bound(spectrum.edges_hz.begin(), spectrum.edges_hz.end(), hz);
  if (above == spectrum.edges_hz.begin() || above == spectrum.edges_hz.end()) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(above - spectrum.edges_hz.begin()) - 1;
}

// A band that stands out of the frequencies around it, a third of its own wide to either side: dither or vibration, which goes on with
// one power. Their middle is by width, so that a line which was cut into several narrow bands stands out too.
bool is_line(const NoiseSpectrum& spectrum, std::size_t band) {
  constexpr double stands_out = 2.0, around = 1.0 / 3.0;
  const double hz = 0.5 * (spectrum.edges_hz[band] + spectrum.edges_hz[band + 1]);
  std::vector<std::pair<double, double>> near;  // density, width
  double whole = 0.0;
  for (std::size_t k = 0; k < spectrum.density.size(); ++k) {
    const double width =
        std::min(spectrum.edges_hz[k + 1], (1.0 + around) * hz) - std::max(spectrum.edges_hz[k], (1.0 - around) * hz);
    if (width > 0.0) {
      near.emplace_back(spectrum.density[k], width);
      whole += width;
    }
  }
  std::sort(near.begin(), near.end());
  double below = 0.0;
  for (const auto& [density, width] : near) {
    below += width;
    if (below >= 0.5 * whole) {
      return spectrum.density[band] > stands_out * density;
    }
  }
  return false;
}

std::size_t block_length(const NoiseSpectrum& spectrum, double rate_hz) {
  constexpr double least = 1024.0, most = 1048576.0, blocks_a_band = 4.0;
  return static_cast<std::size_t>(
      std::exp2(std::ceil(std::log2(std::clamp(blocks_a_band * rate_hz / narrowest(spectrum), least, most)))));
}

}  // namespace

SpectrumNoise::SpectrumNoise(const NoiseSpectrum& spectrum, double rate_hz, std::uint64_t seed)
    : axis_(static_cast<int>(spectrum.channel)),
      half_(block_length(spectrum, rate_hz) / 2),
      at_(0),
      random_(seed, stream_of(spectrum)) {
  const double bin_hz = 0.5 * rate_hz / static_cast<double>(half_);
  std::vector<bool> lines;
  for (std::size_t band = 0; band < spectrum.density.size(); ++band) {
    lines.push_back(is_line(spectrum, band));
  }
  for (std::size_t k = 0; k <= half_; ++k) {
    const auto band = band_at(spectrum, static_cast<double>(k) * bin_hz);
    sigma_.push_back(band ? spectrum.density[*band] * std::sqrt(bin_hz) : 0.0);
    line_.push_back(band && lines[*band]);
  }
  // A band of half the width stands at either end.
  sigma_.front() *= std::numbers::sqrt2 / 2.0;
  sigma_.back() = 0.0;
  current_ = block();
  following_ = block();
}

std::vector<double> SpectrumNoise::block() {
  const std::size_t n = 2 * half_;
  std::vector<std::complex<double>> lines(n, 0.0);
  lines[0] = static_cast<double>(n) * sigma_[0] * random_.normal();
  for (std::size_t k = 1; k < half_; ++k) {
    double cosine = random_.normal(), sine = random_.normal();
    if (line_[k]) {  // its power is not drawn, its phase is
      const double scale = std::numbers::sqrt2 / std::max(1e-12, std::hypot(cosine, sine));
      cosine *= scale;
      sine *= scale;
    }
    lines[k] = 0.5 * static_cast<double>(n) * sigma_[k] * std::complex<double>(cosine, -sine);
    lines[n - k] = std::conj(lines[k]);
  }
  std::vector<std::complex<double>> values;
  Eigen::FFT<double>().inv(values, lines);
  std::vector<double> block(n);
  for (std::size_t i = 0; i < n; ++i) {
    block[i] = values[i].real() * std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
  }
  return block;
}

double SpectrumNoise::next() {
  if (at_ == half_) {
    current_ = std::move(following_);
    following_ = block();
    at_ = 0;
  }
  const double value = current_[half_ + at_] + following_[at_];
  ++at_;
  return value;
}

std::vector<Sine> sines_of(const NoiseSpectrum& spectrum, std::uint64_t seed) {
  constexpr double count = 12.0;  // of a band: their sum is near normal
  Random random(seed, stream_of(spectrum));
  std::vector<Sine> sines;
  for (std::size_t k = 0; k < spectrum.density.size(); ++k) {
    const double low = spectrum.edges_hz[k], high = spectrum.edges_hz[k + 1];
    for (double i = 0.0; i < count && spectrum.density[k] > 0.0; i += 1.0) {
      const double hz = low + (high - low) * (i + random.uniform()) / count;
      const double sigma = spectrum.density[k] * std::sqrt((high - low) / count);
      const double sine = random.normal(), cosine = random.normal();
      sines.push_back({sigma * std::hypot(sine, cosine), 1.0 / std::max(hz, 1e-9), std::atan2(cosine, sine)});
    }
  }
  return sines;
}

void add_tilt(const NoiseSpectrum& spectrum, std::uint64_t seed, BaseMotion& base) {
  const bool roll = spectrum.channel == NoiseSpectrum::Channel::base_roll;
  for (const Sine& sine : sines_of(spectrum, seed)) {
    (roll ? base.roll : base.pitch).push_back(sine);
    if (spectrum.above_m != 0.0) {
      // Right side down moves what is above to the right, bow up moves it back.
      const double moved = (roll ? 1.0 : -1.0) * spectrum.above_m * sine.amplitude;
      (roll ? base.sway : base.surge).push_back({moved, sine.period_s, sine.phase});
    }
  }
}

}  // namespace selfcal::sim
