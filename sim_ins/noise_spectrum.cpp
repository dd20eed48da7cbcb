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

double power_at(const BandLoudness& loudness, double time_s) {
  const double at = time_s / loudness.step_s;
  const auto last = loudness.power.size() - 1;
  if (at >= static_cast<double>(last)) {
    return loudness.power[last];
  }
  const auto k = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(k);
  return (1.0 - share) * loudness.power[k] + share * loudness.power[k + 1];
}

// Share of the amplitude that is above an edge between two bands of loudness, the squares of both sides add up to one.
double share_above(double hz, double edge_hz) {
  constexpr double fade = 1.4;
  const double s = std::clamp(0.5 * (1.0 + std::log(hz / edge_hz) / std::log(fade)), 0.0, 1.0);
  return std::sin(0.5 * std::numbers::pi * s * s * (3.0 - 2.0 * s));
}
double share_below(double hz, double edge_hz) {
  const double above = share_above(hz, edge_hz);
  return std::sqrt(std::max(0.0, 1.0 - above * above));
}

using Lines = std::vector<std::complex<double>>;

// Lines of n samples, which repeat, of the spectrum's noise as loud as it says.
Lines loud_lines(const NoiseSpectrum& spectrum, std::size_t n, double rate_hz, Random& random) {
  Eigen::FFT<double> fft;
  const double bin_hz = rate_hz / static_cast<double>(n);
  Lines sum(n, 0.0), lines;
  std::vector<double> white(n);
  for (std::size_t band = 0; band <= spectrum.loudness.size(); ++band) {
    const bool steady = band == spectrum.loudness.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double power = steady ? 1.0 : power_at(spectrum.loudness[band], static_cast<double>(i) / rate_hz);
      white[i] = std::sqrt(power) * random.normal();
    }
    fft.fwd(lines, white);
    for (std::size_t k = 1; k < n / 2; ++k) {
      const double hz = static_cast<double>(k) * bin_hz;
      if (const auto at = band_at(spectrum, hz)) {
        const double share = (band > 0 ? share_above(hz, spectrum.loudness[band - 1].below_hz) : 1.0) *
                             (steady ? 1.0 : share_below(hz, spectrum.loudness[band].below_hz));
        // White noise of one a sample has the one-sided density 2/rate.
        sum[k] += lines[k] * share * spectrum.density[*at] * std::sqrt(0.5 * rate_hz);
      }
    }
  }
  for (std::size_t k = 1; k < n / 2; ++k) {
    sum[n - k] = std::conj(sum[k]);
  }
  return sum;
}

// `gain` of the amplitude at a frequency.
template <class Gain>
std::vector<double> series_of(Lines lines, double rate_hz, Gain gain) {
  const std::size_t n = lines.size();
  for (std::size_t k = 0; k < n; ++k) {
    lines[k] *= gain(static_cast<double>(std::min(k, n - k)) * rate_hz / static_cast<double>(n));
  }
  Lines values;
  Eigen::FFT<double>().inv(values, lines);
  std::vector<double> series(n);
  std::transform(values.begin(), values.end(), series.begin(), [](const auto& value) { return value.real(); });
  return series;
}

constexpr double steps_a_period = 8.0;

struct TiltSplines {
  NoiseSpline tilt;                  // rad
  std::optional<NoiseSpline> moved;  // m, to where the sensors are moved by a positive tilt; none on the axis
};

// Splines of the fifth degree whose density is the table's: what their coefficients have is over the spline's own response. At eight steps
// a period of the highest frequency what they add above is below 1e-5 of the amplitude.
TiltSplines splines_of(const NoiseSpectrum& spectrum, std::uint64_t seed) {
  constexpr int order = 6;
  Random random(seed, stream_of(spectrum));
  const double rate_hz = steps_a_period * spectrum.edges_hz.back();
  const Lines lines = loud_lines(spectrum, static_cast<std::size_t>(repeats_after(spectrum, rate_hz)), rate_hz, random);
  const auto over_response = [&](double hz) {
    const double x = std::numbers::pi * hz / rate_hz;
    return x > 0.0 ? std::pow(x / std::sin(x), order) : 1.0;
  };
  const auto moved = [&](double hz) {
    const auto band = band_at(spectrum, hz);
    return band ? spectrum.above_m[*band] * over_response(hz) : 0.0;
  };
  TiltSplines splines{{1.0 / rate_hz, series_of(lines, rate_hz, over_response)}, std::nullopt};
  if (!spectrum.above_m.empty()) {
    splines.moved = {1.0 / rate_hz, series_of(lines, rate_hz, moved)};
  }
  return splines;
}

}  // namespace

bool of_base(const NoiseSpectrum& spectrum) {
  return spectrum.channel == NoiseSpectrum::Channel::base_roll ||
         spectrum.channel == NoiseSpectrum::Channel::base_pitch;
}

double repeats_after(const NoiseSpectrum& spectrum, double rate_hz) {
  double longest_s = 0.0;
  for (const BandLoudness& l : spectrum.loudness) {
    longest_s = std::max(longest_s, l.step_s * static_cast<double>(l.power.size()));
  }
  constexpr double least = 16.0;
  const double samples = longest_s * (of_base(spectrum) ? steps_a_period * spectrum.edges_hz.back() : rate_hz);
  return spectrum.loudness.empty() ? 0.0 : std::exp2(std::ceil(std::log2(std::max(samples, least))));
}

SpectrumNoise::SpectrumNoise(const NoiseSpectrum& spectrum, double rate_hz, std::uint64_t seed)
    : axis_(static_cast<int>(spectrum.channel)),
      half_(block_length(spectrum, rate_hz) / 2),
      at_(0),
      random_(seed, stream_of(spectrum)),
      repeats_(!spectrum.loudness.empty()) {
  if (repeats_) {
    const auto length = static_cast<std::size_t>(repeats_after(spectrum, rate_hz));
    current_ = series_of(loud_lines(spectrum, length, rate_hz, random_), rate_hz, [](double) { return 1.0; });
    return;
  }
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
  if (repeats_) {
    const double value = current_[at_];
    at_ = (at_ + 1) % current_.size();
    return value;
  }
  if (at_ == half_) {
    current_ = std::move(following_);
    following_ = block();
    at_ = 0;
  }
  const double value = current_[half_ + at_] + following_[at_];
  ++at_;
  return value;
}

std::vector<TiltSine> sines_of(const NoiseSpectrum& spectrum, std::uint64_t seed) {
  constexpr double count = 12.0;  // of a band: their sum is near normal
  Random random(seed, stream_of(spectrum));
  std::vector<TiltSine> sines;
  for (std::size_t k = 0; k < spectrum.density.size(); ++k) {
    const double low = spectrum.edges_hz[k], high = spectrum.edges_hz[k + 1];
    for (double i = 0.0; i < count && spectrum.density[k] > 0.0; i += 1.0) {
      const double hz = low + (high - low) * (i + random.uniform()) / count;
      const double sigma = spectrum.density[k] * std::sqrt((high - low) / count);
      const double sine = random.normal(), cosine = random.normal();
      sines.push_back({{sigma * std::hypot(sine, cosine), 1.0 / std::max(hz, 1e-9), std::atan2(cosine, sine)},
                       spectrum.above_m.empty() ? 0.0 : spectrum.above_m[k]});
    }
  }
  return sines;
}

void add_tilt(const NoiseSpectrum& spectrum, std::uint64_t seed, BaseMotion& base) {
  const bool roll = spectrum.channel == NoiseSpectrum::Channel::base_roll;
  const double sense = roll ? 1.0 : -1.0;  // right side down moves what is above to the right, bow up moves it back
  if (!spectrum.loudness.empty()) {
    auto [tilt, moved] = splines_of(spectrum, seed);
    if (moved) {
      for (double& m : moved->coefficients) {
        m *= sense;
      }
      (roll ? base.noise_sway : base.noise_surge).push_back(std::move(*moved));
    }
    (roll ? base.noise_roll : base.noise_pitch).push_back(std::move(tilt));
    return;
  }
  for (const auto& [tilt, above_m] : sines_of(spectrum, seed)) {
    (roll ? base.roll : base.pitch).push_back(tilt);
    if (above_m != 0.0) {
      (roll ? base.sway : base.surge).push_back({sense * above_m * tilt.amplitude, tilt.period_s, tilt.phase});
    }
  }
}

}  // namespace selfcal::sim
