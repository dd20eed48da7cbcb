#include "estimator/models/quantised_rate.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/models/dwell_periodogram.hpp"

namespace selfcal {
namespace {

using std::numbers::pi;

constexpr int lowest_bin = DwellPeriodogram::lowest_bin,
              bin_count = DwellPeriodogram::bin_count;  // 0.19 to 0.8 Hz of 32 s
constexpr double margin_s = 1.0;                        // left out at both ends of a dwell
constexpr int enough_pieces = 10;                       // of an axis
constexpr int rounds = 40, rounds_before_lines = 10;
constexpr double least_used = 0.1;  // of the values
// Taper sin^4: neighbouring bins share noise, and a sum over bins scatters by mean(w^4)/mean(w^2)^2 of independent ones:
// mean(sin^16) = 6435/32768, mean(sin^8) = 35/128.
constexpr double taper_spread = 6435.0 / 32768.0 / (35.0 / 128.0 * 35.0 / 128.0);

using Bins = DwellPeriodogram::Bins;

// One axis in one dwell: mean periodogram and mean rate.
struct AxisDwell {
  Eigen::Index axis = 0;
  Bins density = Bins::Zero();
  int pieces = 0;
  double rate = 0.0;
};

std::vector<AxisDwell> axis_dwells(std::span<const std::array<double, 3>> increments, double rate_hz,
                                   const std::vector<Segment>& segments, std::size_t length) {
  // At the full rate: sums over groups would fold the quantum's noise, which is that of an angle, down from above.
  const DwellPeriodogram analysis(static_cast<Eigen::Index>(length));
  const auto margin = static_cast<std::size_t>(margin_s * rate_hz);
  std::vector<AxisDwell> all;
  Eigen::VectorXd rates(static_cast<Eigen::Index>(length));
  for (const Segment& s : segments) {
    if (s.rotation || s.last - s.first < 2 * margin + length) {
      continue;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      AxisDwell dwell;
      dwell.axis = static_cast<Eigen::Index>(axis);
      double angle = 0.0;
      for (std::size_t i = s.first + margin; i < s.last - margin; ++i) {
        angle += increments[i][axis];
      }
      dwell.rate = angle * rate_hz / static_cast<double>(s.last - s.first - 2 * margin);
      for (std::size_t first = s.first + margin; first + length <= s.last - margin; first += length) {
        for (std::size_t i = 0; i < length; ++i) {
          rates(static_cast<Eigen::Index>(i)) = increments[first + i][axis] * rate_hz - dwell.rate;
        }
        dwell.density += analysis.density(rates, 1.0 / rate_hz);
        ++dwell.pieces;
      }
      dwell.density /= dwell.pieces;
      all.push_back(dwell);
    }
  }
  return all;
}

// Least squares of density = white + angle * shape + quantum's, each value weighted by its model: it scatters by that.
class WhittleFit {
 public:
  WhittleFit(const std::vector<AxisDwell>& dwells, double rate_hz, double quantum, double piece_s, double first_asd,
             double most_hidden)
      : dwells_(dwells),
        rate_hz_(rate_hz),
        quantum_(quantum),
        piece_s_(piece_s),
        most_hidden_(most_hidden),
        white_(first_asd * first_asd) {
    for (int b = 0; b < bin_count; ++b) {
      const double sine = std::sin(pi * frequency(b) / rate_hz_);
      shape_(b) = 4.0 * sine * sine * rate_hz_;
    }
    if (std::isfinite(most_hidden_)) {
      white_ = low_quartile();
    }
  }

  QuantisedRate run() {
    for (int round = 0; round < rounds; ++round) {
      const double before = white_;
      step(round >= rounds_before_lines);
      constexpr double still = 1e-5;
      if (round > rounds_before_lines && std::abs(white_ - before) < still * white_) {
        break;
      }
    }
    if (used_ < least_used * static_cast<double>(dwells_.size() * bin_count)) {
      return {};
    }
    const double asd = std::sqrt(white_);
    const double variance = taper_spread * normal_.inverse()(0, 0);
    return {asd, 0.5 * std::sqrt(variance) / asd, std::sqrt(angle_ + quantum_ * quantum_ / 12.0)};
  }

 private:
  // Of all densities: a first guess where many bins hold lines of the quantum.
  double low_quartile() const {
    std::vector<double> all;
    for (const AxisDwell& dwell : dwells_) {
      all.insert(all.end(), dwell.density.begin(), dwell.density.end());
    }
    const auto quarter = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 4);
    std::nth_element(all.begin(), quarter, all.end());
    return *quarter;
  }

  double frequency(int b) const { return (b + lowest_bin) / piece_s_; }

  // Where a bin of an axis is twice the model in the mean of the dwells: a line that stays; chance does it once in 1e5.
  void find_lines(const std::vector<Bins>& models) {
    Eigen::Array<double, bin_count, 3> sum = Eigen::Array<double, bin_count, 3>::Zero();
    Eigen::Array3d pieces = Eigen::Array3d::Zero();
    for (std::size_t d = 0; d < dwells_.size(); ++d) {
      sum.col(dwells_[d].axis) += dwells_[d].pieces * dwells_[d].density / models[d];
      pieces(dwells_[d].axis) += dwells_[d].pieces;
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      line_.col(axis) = sum.col(axis) > 2.0 * pieces(axis);
    }
  }

  // One round; `used_` counts its values.
  void step(bool without_lines) {
    used_ = 0.0;
    const double asd = std::sqrt(white_);
    std::vector<Bins> hidden(dwells_.size()), models(dwells_.size());
    for (std::size_t d = 0; d < dwells_.size(); ++d) {
      for (int b = 0; b < bin_count; ++b) {
        hidden[d](b) = quantum_density(frequency(b), dwells_[d].rate, quantum_, asd, rate_hz_);
      }
      models[d] = white_ + angle_ * shape_ + hidden[d];
    }
    if (without_lines) {
      find_lines(models);
    }
    normal_.setZero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t d = 0; d < dwells_.size(); ++d) {
      const AxisDwell& dwell = dwells_[d];
      // Mean of p values of an exponential distribution: beyond 1 + 8/sqrt(p) once in several thousand; a line of this dwell.
      const double most = 1.0 + 8.0 / std::sqrt(dwell.pieces);
      for (int b = 0; b < bin_count; ++b) {
        const double model = models[d](b);
        if (hidden[d](b) > most_hidden_ * (model - hidden[d](b))) {
          continue;
        }
        if (without_lines && (line_(b, dwell.axis) || dwell.density(b) > most * model)) {
          continue;
        }
        used_ += 1.0;
        const Eigen::Vector2d row(1.0 / model, shape_(b) / model);
        normal_ += dwell.pieces * row * row.transpose();
        right += dwell.pieces * row * (dwell.density(b) - hidden[d](b)) / model;
      }
    }
    constexpr double slowest = 0.01;  // of the density, in one round
    angle_ = std::max(0.0, (normal_.inverse() * right)(1));
    white_ = std::max(slowest * white_, (right(0) - normal_(0, 1) * angle_) / normal_(0, 0));
  }

  const std::vector<AxisDwell>& dwells_;
  double rate_hz_, quantum_, piece_s_, most_hidden_;
  double white_, angle_ = 0.0;
  double used_ = 0.0;
  Bins shape_;
  Eigen::Array<bool, bin_count, 3> line_ = Eigen::Array<bool, bin_count, 3>::Constant(false);
  Eigen::Matrix2d normal_;
};

}  // namespace

// The error of the angle is a sawtooth of the angle itself, of period q: sum of q/(pi k) sin(2 pi k angle/q). At a steady
// rate r the angle runs on by r t and walks: harmonic k is a line at k r/q, its phase walks, and its correlation falls
// with exp(-g |t|), g = (2 pi k N/q)^2/2. Taken at the samples: a first-order process, folded, in closed form. From
// there on where it forgets within a sample, all further harmonics together are white. The walk itself and the error do
// not correlate, as the phase is uniform. Only where the noise of a sample reaches the quantum is all of it white.
double quantum_density(double frequency_hz, double mean_rate, double quantum, double white_asd, double rate_hz) {
  constexpr int most_harmonics = 200;
  constexpr double forgotten = 1e-3;
  const double dt = 1.0 / rate_hz;
  double density = 0.0, rest = quantum * quantum / 12.0;
  for (int k = 1; k <= most_harmonics; ++k) {
    const double phase_rate = 2.0 * pi * k * white_asd / quantum;
    const double kept = std::exp(-0.5 * phase_rate * phase_rate * dt);
    if (kept < forgotten) {
      break;
    }
    const double power = quantum * quantum / (2.0 * pi * pi * k * k);
    const double line = k * mean_rate / quantum;
    for (const double f : {frequency_hz - line, frequency_hz + line}) {
      density +=
          0.5 * power * dt * (1.0 - kept * kept) / (1.0 - 2.0 * kept * std::cos(2.0 * pi * f * dt) + kept * kept);
    }
    rest -= power;
  }
  const double sine = std::sin(pi * frequency_hz * dt);
  return (density + std::max(rest, 0.0) * dt) * 4.0 * sine * sine * rate_hz * rate_hz;
}

QuantisedRate fit_quantised_rate(std::span<const std::array<double, 3>> increments, double rate_hz,
                                 const std::vector<Segment>& segments, double quantum, double piece_s, double first_asd,
                                 double most_hidden) {
  const auto length = static_cast<std::size_t>(std::lround(piece_s * rate_hz));
  const std::vector<AxisDwell> dwells = axis_dwells(increments, rate_hz, segments, length);
  int pieces = 0;
  for (const AxisDwell& dwell : dwells) {
    pieces += dwell.pieces;
  }
  if (pieces < 3 * enough_pieces) {
    return {};
  }
  return WhittleFit(dwells, rate_hz, quantum, static_cast<double>(length) / rate_hz, first_asd, most_hidden).run();
}

}  // namespace selfcal
