#include "estimator/models/sensor_noise.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "estimator/models/dwell_periodogram.hpp"
#include "estimator/models/quantised_rate.hpp"

namespace selfcal {
namespace {

using Increments = std::span<const std::array<double, 3>>;

constexpr int piece_length = 64;  // groups
// Increments are summed into groups. 0.05 s: pieces of 3.2 s, 1.9 to 8 Hz, where sway has died out. Gyros on a still
// base 0.5 s: 32 s, 0.19 to 0.8 Hz, because a slow steady rate leaves their quantisation far from white above that.
constexpr double slow_group_s = 0.5, fast_group_s = 0.05;
constexpr int lowest_bins = 5;
constexpr std::size_t enough_pieces = 10;
constexpr std::size_t most_pieces = 600;  // 10 x 600 periodogram values fix a density to 1 %
constexpr double margin_s = 1.0;          // left out at both ends of a dwell
// Of the density at the lowest bins, at least so much is left to the white rate. On a still base a steady rate makes
// the quantisation periodic, and it can look like white angle all the way down. A moving base sweeps over hundreds of
// quanta in a group: then it is white angle, and may well be four fifths of what is seen there.
constexpr double least_white_still = 0.3, least_white_moving = 0.03;

using Bins = DwellPeriodogram::Bins;

const DwellPeriodogram& analysis() {
  static const DwellPeriodogram once(piece_length);
  return once;
}

struct Spectrum {
  Bins density = Bins::Zero();
  std::size_t pieces = 0;
  double group_s = 0.0;  // as grouped: whole samples
};

Spectrum mean_spectrum(Increments increments, double rate_hz, const std::vector<Segment>& segments, double group_s) {
  const auto group = static_cast<std::size_t>(std::max(1.0, std::round(group_s * rate_hz)));
  const std::size_t length = group * piece_length;
  const auto margin = static_cast<std::size_t>(margin_s * rate_hz);
  std::size_t available = 0;
  for (const Segment& s : segments) {
    available += s.rotation || s.last - s.first < 2 * margin ? 0 : (s.last - s.first - 2 * margin) / length;
  }
  const std::size_t stride = std::max<std::size_t>(1, available / most_pieces);
  Spectrum spectrum;
  spectrum.group_s = static_cast<double>(group) / rate_hz;
  std::size_t piece = 0;
  Eigen::VectorXd rates(piece_length);
  for (const Segment& s : segments) {
    if (s.rotation || s.last - s.first < 2 * margin) {
      continue;
    }
    for (std::size_t first = s.first + margin; first + length <= s.last - margin; first += length) {
      if (piece++ % stride != 0) {
        continue;
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < piece_length; ++i) {
          double sum = 0.0;
          for (std::size_t k = 0; k < group; ++k) {
            sum += increments[first + static_cast<std::size_t>(i) * group + k][axis];
          }
          rates(i) = sum / spectrum.group_s;
        }
        spectrum.density += analysis().density(rates, spectrum.group_s) / 3.0;
      }
      ++spectrum.pieces;
    }
  }
  if (spectrum.pieces > 0) {
    spectrum.density /= static_cast<double>(spectrum.pieces);
  }
  return spectrum;
}

// density = N^2 + Q^2 * (about) 4 sin^2(pi f D)/D: weighted by the model (a periodogram scatters as its mean), lines left out.
// A quantum that is carried on (known_angle) leaves quantum^2/12 of white angle; it is then not fitted.
void fit_density(const Spectrum& spectrum, std::optional<double> known_angle, double least_white, TriadNoise& noise) {
  const Eigen::Index bins = spectrum.density.size();
  const Bins shape = analysis().angle_density(spectrum.group_s);
  std::vector<double> sorted(spectrum.density.begin(), spectrum.density.end());
  std::nth_element(sorted.begin(), sorted.begin() + bins / 2, sorted.end());
  double white = sorted[static_cast<std::size_t>(bins / 2)];
  double angle = known_angle.value_or(0.0);
  const double least = std::max(1e-6 * white, least_white * spectrum.density.head(lowest_bins).mean());
  for (int round = 0; round < 20; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (Eigen::Index b = 0; b < bins; ++b) {
      const double model = white + angle * shape(b);
      if (round > 0 && spectrum.density(b) > 2.0 * model) {
        continue;  // a line
      }
      const Eigen::Vector2d row(1.0 / model, shape(b) / model);
      normal += row * row.transpose();
      right += row * spectrum.density(b) / model;
    }
    if (!known_angle) {
      const Eigen::Vector2d fit = normal.inverse() * right;
      angle = fit(0) > least ? std::max(0.0, fit(1)) : std::max(0.0, (right(1) - normal(0, 1) * least) / normal(1, 1));
    }
    white = std::max(least, (right(0) - normal(0, 1) * angle) / normal(0, 0));
  }
  noise.white_asd = std::sqrt(white);
  noise.increment_sigma = std::sqrt(angle);
}

// The first ones that are observations.
std::vector<std::array<double, 3>> first_of(Increments increments, std::span<const Coast> coasts) {
  constexpr std::size_t enough = 4000;
  std::vector<std::array<double, 3>> first;
  auto coast = coasts.begin();
  for (std::size_t i = 0; i < increments.size() && first.size() < enough; ++i) {
    while (coast != coasts.end() && coast->last <= i) {
      ++coast;
    }
    if (coast == coasts.end() || i < coast->first) {
      first.push_back(increments[i]);
    }
  }
  return first;
}

// The quantum: increments that are whole multiples of a step larger than their own rounding, and so what they differ by from one to the next.
double find_quantum(const std::vector<std::array<double, 3>>& increments) {
  double smallest = std::numeric_limits<double>::infinity(), largest = 0.0;
  for (const std::array<double, 3>& increment : increments) {
    for (const double x : increment) {
      largest = std::max(largest, std::abs(x));
    }
  }
  const double rounding = 1e-9 * largest;
  std::array<double, 3> before{};
  for (const std::array<double, 3>& increment : increments) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const double size : {std::abs(increment[axis]), std::abs(increment[axis] - before[axis])}) {
        smallest = size > rounding ? std::min(smallest, size) : smallest;
      }
    }
    before = increment;
  }
  if (!std::isfinite(smallest)) {
    return 0.0;
  }
  // The smallest step seen may be several quanta.
  constexpr int most_quanta = 30;
  for (int quanta = 1; quanta <= most_quanta; ++quanta) {
    const double step = smallest / quanta;
    const auto whole = [step](const std::array<double, 3>& increment) {
      return std::all_of(increment.begin(), increment.end(), [step](double x) {
        const double ratio = x / step;
        return std::abs(ratio - std::round(ratio)) < 1e-3;
      });
    };
    if (std::all_of(increments.begin(), increments.end(), whole)) {
      return largest / std::round(largest / step);  // a difference has lost digits
    }
  }
  return 0.0;
}

// Of the second variance: what the quantum's remainders at both ends of either second make of it.
double of_quantum(double quantum) { return 0.25 * quantum * quantum; }

// Half the mean square of differences of successive 1 s sums inside dwells.
double second_variance(const ImuData& data, const std::vector<Segment>& segments) {
  const auto second = static_cast<std::size_t>(std::max(1.0, std::round(data.sample_rate_hz)));
  double sum = 0.0;
  std::size_t count = 0;
  for (const Segment& s : segments) {
    if (s.rotation) {
      continue;
    }
    Vector3 previous = Vector3::Zero();
    bool have = false;
    for (std::size_t first = s.first + second; first + 2 * second <= s.last; first += second) {
      Vector3 velocity = Vector3::Zero();
      for (std::size_t i = first; i < first + second; ++i) {
        velocity += Eigen::Map<const Vector3>(data.delta_v[i].data());
      }
      if (have) {
        sum += (velocity - previous).squaredNorm() / 6.0;
        ++count;
      }
      previous = velocity;
      have = true;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

// So long that a piece fits into the median dwell, and no longer than the slow group.
double slow_group(const std::vector<Segment>& segments) {
  std::vector<double> dwells;
  for (const Segment& segment : segments) {
    if (!segment.rotation) {
      dwells.push_back(segment.end_s - segment.start_s - 2.0 * margin_s);
    }
  }
  if (dwells.empty()) {
    return fast_group_s;
  }
  const auto middle = dwells.begin() + static_cast<std::ptrdiff_t>(dwells.size() / 2);
  std::nth_element(dwells.begin(), middle, dwells.end());
  return std::clamp(0.98 * *middle / piece_length, fast_group_s, slow_group_s);
}

}  // namespace

Quanta find_quanta(const ImuData& data) {
  return data.quanta ? *data.quanta
                     : Quanta{find_quantum(first_of(data.delta_theta, data.coasts)),
                              find_quantum(first_of(data.delta_v, data.coasts))};
}

SensorNoise estimate_sensor_noise(const ImuData& data, const std::vector<Segment>& segments) {
  SensorNoise noise;
  const Quanta quanta = find_quanta(data);
  noise.gyro.quantum = quanta.angle;
  noise.accel.quantum = quanta.velocity;
  const Spectrum accel = mean_spectrum(data.delta_v, data.sample_rate_hz, segments, fast_group_s);
  noise.spectra = accel.pieces;
  if (noise.spectra == 0) {
    return noise;
  }
  const double accel_quantum = noise.accel.quantum;
  fit_density(accel, accel_quantum > 0.0 ? std::optional(accel_quantum * accel_quantum / 12.0) : std::nullopt,
              least_white_still, noise.accel);
  // Five times the noise and more is motion: chance gives sqrt(1 +- 0.1) at most.
  const double expected = noise.accel.white_asd * noise.accel.white_asd;
  noise.base_moves = second_variance(data, segments) > 25.0 * (expected + of_quantum(accel_quantum));
  const double group_s = noise.base_moves ? fast_group_s : slow_group(segments);
  Spectrum gyro = mean_spectrum(data.delta_theta, data.sample_rate_hz, segments, group_s);
  if (gyro.pieces < enough_pieces && !noise.base_moves) {
    gyro = mean_spectrum(data.delta_theta, data.sample_rate_hz, segments, fast_group_s);
  }
  fit_density(gyro, std::nullopt, noise.base_moves ? least_white_moving : least_white_still, noise.gyro);
  const bool turned = std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.rotation; });
  if (turned && !noise.base_moves && accel_quantum > 0.0) {
    // A coarse quantum hides the white noise in the band above, and is found for it. Below, where it hides less, all else is louder: what
    // is found there counts where it is less, beyond chance. Where nothing turned there is but one set of the quantum's lines, and the
    // noise is that of the drift (passes/noise_fit.hpp).
    constexpr double less = 0.85, most_hidden = 3.0;
    const QuantisedRate behind = fit_quantised_rate(data.delta_v, data.sample_rate_hz, segments, accel_quantum,
                                                    piece_length * group_s, noise.accel.white_asd, most_hidden);
    if (behind.white_asd > 0.0 && behind.white_asd < less * noise.accel.white_asd) {
      noise.accel.white_asd = behind.white_asd;
      noise.accel.increment_sigma = behind.increment_sigma;
    }
  }
  if (!noise.base_moves && noise.gyro.quantum > 0.0) {
    const QuantisedRate behind = fit_quantised_rate(data.delta_theta, data.sample_rate_hz, segments, noise.gyro.quantum,
                                                    piece_length * group_s, noise.gyro.white_asd);
    if (behind.white_asd > 0.0) {
      noise.gyro.white_asd = behind.white_asd;
      noise.gyro.white_sigma = behind.white_sigma;
      noise.gyro.increment_sigma = behind.increment_sigma;
    }
  }
  return noise;
}

}  // namespace selfcal
