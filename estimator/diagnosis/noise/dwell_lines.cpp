#include "estimator/diagnosis/noise/dwell_lines.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "estimator/diagnosis/noise/quantum_beat.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double lowest_hz = 0.1, highest_hz = 2.0;
constexpr double least_dwell_s = 30.0;
constexpr double log_false_lines = -4.6;  // one false line in a hundred recordings
constexpr double half_as_strong = 0.5;    // a beat that makes so much of a line is what it is
constexpr Eigen::Index neighbours = 12;   // bins to either side whose median is the background

struct Line {
  double frequency_hz = 0.0;
  double log_p = 0.0;
};

// Peaks of the dwell's spectrum over its neighbourhood. What comes from white noise of the integral grows as f^2, so
// bins are compared as densities of velocity or angle would be, divided by it.
std::vector<Line> peaks(const Eigen::VectorXd& rate, double rate_hz, double bins_searched) {
  const Eigen::Index n = rate.size();
  Eigen::VectorXd windowed = rate.array() - rate.mean();
  for (Eigen::Index i = 0; i < n; ++i) {
    windowed(i) *= 1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
  }
  Eigen::FFT<double> fft;
  Eigen::VectorXcd transform;
  fft.fwd(transform, windowed);
  const double bin_hz = rate_hz / static_cast<double>(n);
  const auto first = static_cast<Eigen::Index>(std::ceil(lowest_hz / bin_hz));
  const Eigen::Index last = std::min(static_cast<Eigen::Index>(highest_hz / bin_hz), n / 2 - neighbours - 2);
  std::vector<double> power(static_cast<std::size_t>(n / 2));
  for (Eigen::Index b = 1; b < n / 2; ++b) {
    power[static_cast<std::size_t>(b)] = std::norm(transform(b)) / static_cast<double>(b * b);
  }
  std::vector<Line> lines;
  for (Eigen::Index b = first; b <= last; ++b) {
    const auto at = power.begin() + b;
    if (*at < *(at - 1) || *at <= *(at + 1)) {
      continue;
    }
    std::vector<double> around(power.begin() + std::max<Eigen::Index>(first, b - neighbours), at + neighbours + 1);
    std::nth_element(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2), around.end());
    // Of noise a bin is exponential, and its median the mean's ln 2.
    const double log_p = -*at / around[around.size() / 2] * std::numbers::ln2 + std::log(bins_searched);
    if (log_p < log_false_lines) {
      // Hann: the ratio of the neighbours tells where between two bins the peak lies.
      const bool right = *(at + 1) > *(at - 1);
      const double side = std::sqrt(std::max(*(at + 1), *(at - 1)) / *at);
      const double offset = std::clamp((2.0 * side - 1.0) / (1.0 + side), 0.0, 0.5);
      lines.push_back({(static_cast<double>(b) + (right ? offset : -offset)) * bin_hz, log_p});
    }
  }
  return lines;
}

// Cosine and sine of every line, fitted with mean and slope.
Eigen::MatrixXd fitted(const Eigen::VectorXd& rate, const std::vector<Line>& lines, double rate_hz,
                       Eigen::VectorXd& size) {
  const Eigen::Index n = rate.size();
  const auto pairs = static_cast<Eigen::Index>(2 * lines.size());
  Eigen::MatrixXd design(n, pairs + 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    for (std::size_t k = 0; k < lines.size(); ++k) {
      const double phase = 2.0 * std::numbers::pi * lines[k].frequency_hz * t;
      design(i, static_cast<Eigen::Index>(2 * k)) = std::cos(phase);
      design(i, static_cast<Eigen::Index>(2 * k) + 1) = std::sin(phase);
    }
    design(i, pairs) = 1.0;
    design(i, pairs + 1) = 2.0 * static_cast<double>(i) / static_cast<double>(n) - 1.0;
  }
  size = design.householderQr().solve(rate).head(pairs);
  return design.leftCols(pairs);
}

// Whether taking it out makes each half of the dwell quieter. A beat goes on as long as nothing turns; the base that rocks or tilts in one part
// of a dwell has peaks in its spectrum too, and a sine taken out for them puts one into the other part. `rate`: all but this line is
// taken out. Hann's weights keep the steps of a coarse quantum at the ends out.
bool steady(const Eigen::VectorXd& rate, const Line& line, const Eigen::Vector2d& size, double rate_hz) {
  const Eigen::Index half = rate.size() / 2;
  for (const Eigen::Index first : {Eigen::Index{0}, rate.size() - half}) {
    Eigen::Vector2d there = Eigen::Vector2d::Zero();
    for (Eigen::Index i = 0; i < half; ++i) {
      const double weight =
          1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(half));
      const double phase = 2.0 * std::numbers::pi * line.frequency_hz * static_cast<double>(first + i) / rate_hz;
      there += weight * rate(first + i) * Eigen::Vector2d(std::cos(phase), std::sin(phase));
    }
    there *= 2.0 / static_cast<double>(half);
    if (there.dot(size) < 0.5 * size.squaredNorm()) {
      return false;
    }
  }
  return true;
}

// Those of the lines that are steady beside the others.
std::vector<Line> steady_ones(const Eigen::VectorXd& rate, const std::vector<Line>& lines, double rate_hz) {
  if (lines.empty()) {
    return {};
  }
  Eigen::VectorXd size;
  const Eigen::MatrixXd design = fitted(rate, lines, rate_hz, size);
  Eigen::VectorXd left = rate - design * size;
  left.array() -= left.mean();
  std::vector<Line> kept;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(2 * k);
    const Eigen::Vector2d own = size.segment<2>(at);
    if (steady(left + design.middleCols<2>(at) * own, lines[k], own, rate_hz)) {
      kept.push_back(lines[k]);
    }
  }
  return kept;
}

Vector3 mean_of(std::span<const std::array<double, 3>> increments, const Segment& s) {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = s.first; i < s.last; ++i) {
    sum += Vector3(increments[i].data());
  }
  return sum / static_cast<double>(s.last - s.first);
}

Vector3 mean_force(const ImuData& data, const Segment& s) { return data.sample_rate_hz * mean_of(data.delta_v, s); }

// [n x 3] What the base's tilt changes the specific force by, as the gyros turn gravity: -phi x f, phi their angle less its mean rate. A base
// that tilts to and fro once in a dwell has a peak in each half too. Of the second order: 5 ug of 10 arcmin.
Eigen::MatrixX3d force_of_tilt(const ImuData& data, const Segment& s, const Vector3& force) {
  const Vector3 mean = mean_of(data.delta_theta, s);
  const auto n = static_cast<Eigen::Index>(s.last - s.first);
  Eigen::MatrixX3d tilt(n, 3);
  Vector3 phi = Vector3::Zero();
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vector3 step = Vector3(data.delta_theta[s.first + static_cast<std::size_t>(i)].data()) - mean;
    tilt.row(i) = force.cross(phi + 0.5 * step).transpose();
    phi += step;
  }
  return tilt;
}

// [n x 3] What the accelerometers read in a dwell beside mean and the tilt that the gyros tell, m/s^2.
Eigen::MatrixX3d beside_tilt(const ImuData& data, const Segment& s, const Eigen::MatrixX3d& tilt) {
  Eigen::MatrixX3d left(tilt.rows(), 3);
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    left.row(i) =
        data.sample_rate_hz * Vector3(data.delta_v[s.first + static_cast<std::size_t>(i)].data()).transpose() -
        tilt.row(i);
  }
  return left.rowwise() - left.colwise().mean();
}

// Amplitudes of three columns at a frequency, by Hann's weights.
Eigen::RowVector3cd amplitudes_at(const Eigen::MatrixX3d& columns, double frequency_hz, double rate_hz) {
  Eigen::RowVector3cd sum = Eigen::RowVector3cd::Zero();
  const auto n = static_cast<double>(columns.rows());
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    const double weight = 1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / n);
    sum += weight * columns.row(i) *
           std::polar(1.0, -2.0 * std::numbers::pi * frequency_hz * static_cast<double>(i) / rate_hz);
  }
  return 2.0 / n * sum;
}

// Whether the base turns as a gyro's line tells: gravity turns with it, so that beside the tilt that all of the gyros' rates make nothing of it is
// left. A line of the gyro's own leaves the tilt that it does not make. What the accelerometers' noise hides is no base's.
bool is_of_base(const Eigen::MatrixX3d& left, const Vector3& force, int gyro, const Line& line,
                const Eigen::Vector2d& size, double rate_hz) {
  // A rate of a cos + b sin is Re (a - ib) exp(iwt); its angle is that over iw, and tilts the force by force x angle.
  const std::complex<double> rate(size(0), -size(1));
  const double w = 2.0 * std::numbers::pi * line.frequency_hz;
  const Eigen::RowVector3cd tilt =
      (force.cross(Vector3::Unit(gyro)).cast<std::complex<double>>() * rate / std::complex<double>(0.0, w)).transpose();
  const double duration_s = static_cast<double>(left.rows()) / rate_hz;
  double noise = 0.0;  // square, beside the line
  int bins = 0;
  for (const int bin : {-5, -4, -3, 3, 4, 5}) {
    const double frequency_hz = line.frequency_hz + bin / duration_s;
    if (frequency_hz > 1.0 / duration_s) {
      noise += amplitudes_at(left, frequency_hz, rate_hz).squaredNorm();
      ++bins;
    }
  }
  // Of the base's line 0, of the gyro's own -1. Noise has two phases and three axes.
  constexpr double sure = 0.4;
  if (bins == 0 || std::sqrt(noise / bins / 6.0) > sure * tilt.norm()) {
    return false;
  }
  const double share =
      tilt.conjugate().cwiseProduct(amplitudes_at(left, line.frequency_hz, rate_hz)).sum().real() / tilt.squaredNorm();
  return share > -half_as_strong;
}

// What the sensors' quanta make of their rates in a dwell. The tilt that is taken out of the force holds the gyros' too.
class Beats {
 public:
  Beats(const ImuData& data, const Segment& s, const Quanta& quanta) {
    const std::size_t half = (s.last - s.first) / 2;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const auto mean = [&](std::size_t first) {
        double sum = 0.0;
        for (std::size_t i = first; i < first + half; ++i) {
          sum += axis < 3 ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3];
        }
        return sum * data.sample_rate_hz / static_cast<double>(half);
      };
      const double before = mean(s.first), after = mean(s.first + half);
      axes_[axis] = {0.5 * (before + after), 0.5 * std::abs(after - before), axis < 3 ? quanta.angle : quanta.velocity,
                     data.sample_rate_hz};
    }
  }
  bool hold(int axis, double frequency_hz, double amplitude, double width_hz) const {
    bool any = beat_of_quantum(axes_[static_cast<std::size_t>(axis)], frequency_hz, amplitude, width_hz);
    const double rate_of_tilt = 2.0 * std::numbers::pi * frequency_hz * amplitude / units::standard_gravity;
    for (std::size_t gyro = 0; gyro < 3 && axis >= 3; ++gyro) {
      any = any || beat_of_quantum(axes_[gyro], frequency_hz, rate_of_tilt, width_hz);
    }
    return any;
  }

 private:
  std::array<CountedRate, 6> axes_;
};

// Takes the lines that are the base's off LINES of a gyro's rate.
void leave_out_base(const Eigen::MatrixX3d& left, const Vector3& force, int gyro, const Eigen::VectorXd& rate,
                    double rate_hz, std::vector<Line>& lines) {
  if (lines.empty()) {
    return;
  }
  Eigen::VectorXd size;
  fitted(rate, lines, rate_hz, size);
  std::vector<Line> own;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (!is_of_base(left, force, gyro, lines[k], size.segment<2>(static_cast<Eigen::Index>(2 * k)), rate_hz)) {
      own.push_back(lines[k]);
    }
  }
  lines = std::move(own);
}

void keep_strongest(std::vector<VibrationLine>& all, const VibrationLine& line, double resolution_hz) {
  const auto same = std::find_if(all.begin(), all.end(), [&](const VibrationLine& l) {
    return l.axis == line.axis && std::abs(l.frequency_hz - line.frequency_hz) < resolution_hz;
  });
  if (same == all.end()) {
    all.push_back(line);
  } else if (line.amplitude > same->amplitude) {
    *same = line;
  }
}

}  // namespace

std::vector<VibrationLine> subtract_dwell_lines(const ImuData& data, const std::vector<Segment>& segments,
                                                const Quanta& quanta, AngleVelocity& delta_theta,
                                                AngleVelocity& delta_v) {
  std::vector<VibrationLine> all;
  const double fs = data.sample_rate_hz;
  for (const Segment& s : segments) {
    const double length = static_cast<double>(s.last - s.first) / fs;
    if (s.rotation || length < least_dwell_s) {
      continue;
    }
    const Vector3 force = mean_force(data, s);
    const Eigen::MatrixX3d tilt = force_of_tilt(data, s, force), left = beside_tilt(data, s, tilt);
    const Beats beats(data, s, quanta);
    const double searched = 6.0 * static_cast<double>(segments.size()) * highest_hz * length;
    for (int axis = 0; axis < 6; ++axis) {
      AngleVelocity& increments = axis < 3 ? delta_theta : delta_v;
      const auto k = static_cast<std::size_t>(axis % 3);
      Eigen::VectorXd rate(static_cast<Eigen::Index>(s.last - s.first));
      for (Eigen::Index i = 0; i < rate.size(); ++i) {
        rate(i) = increments[s.first + static_cast<std::size_t>(i)][k] * fs;
      }
      if (axis >= 3) {
        rate -= tilt.col(axis - 3);
      }
      std::vector<Line> lines = steady_ones(rate, peaks(rate, fs, searched), fs);
      if (axis < 3) {
        leave_out_base(left, force, axis, rate, fs, lines);
      }
      if (lines.empty()) {
        continue;
      }
      Eigen::VectorXd size;
      const Eigen::MatrixXd design = fitted(rate, lines, fs, size);
      const Eigen::VectorXd taken = design * size;
      for (Eigen::Index i = 0; i < rate.size(); ++i) {
        increments[s.first + static_cast<std::size_t>(i)][k] -= taken(i) / fs;
      }
      for (std::size_t l = 0; l < lines.size(); ++l) {
        const double amplitude = size.segment<2>(static_cast<Eigen::Index>(2 * l)).norm();
        const bool beat = beats.hold(axis, lines[l].frequency_hz, half_as_strong * amplitude, 2.0 / length);
        keep_strongest(all, {axis, lines[l].frequency_hz, amplitude, lines[l].log_p, beat}, 2.0 / length);
      }
    }
  }
  return all;
}

}  // namespace selfcal::diagnosis
