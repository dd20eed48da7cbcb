#include "estimator/diagnosis/noise/noise_spectra.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <utility>

namespace selfcal::diagnosis {
namespace {

using Complex = std::complex<double>;
// Gyros, accelerometers, and the angle about either tilt axis that the gyros integrate to.
constexpr Eigen::Index channels = 8, first_angle = 6;
using Line = Eigen::Matrix<Complex, channels, 1>;
using Density = Eigen::Matrix<Complex, channels, channels>;  // cross-spectra

// Rates about, and specific force across: what a tilt of the base makes of both. Force: angle times g.
struct TiltAxis {
  Vector3 about, across;
};
struct Base {
  double g = 0.0;
  bool level = false;            // x of b, within 11 deg
  std::array<TiltAxis, 2> axes;  // roll, pitch
};

struct Stretch {
  std::size_t first, last;  // samples [first, last)
  std::size_t size() const { return last - first; }
};

std::vector<Stretch> quiet_stretches(const ImuData& data, const std::vector<Segment>& segments) {
  constexpr double settling_s = 2.0;
  const auto margin = static_cast<std::size_t>(settling_s * data.sample_rate_hz);
  std::vector<Stretch> stretches;
  for (const Segment& s : observed(segments, data)) {
    if (!s.rotation && s.last - s.first > 4 * margin) {
      stretches.push_back({s.first + margin, s.last - margin});
    }
  }
  return stretches;
}

std::vector<Segment> as_segments(const std::vector<Stretch>& stretches) {
  std::vector<Segment> segments;
  segments.reserve(stretches.size());
  for (const Stretch& s : stretches) {
    segments.push_back({.first = s.first, .last = s.last});
  }
  return segments;
}

// A bin of the spectra of one length of pieces.
struct Bin {
  double low_hz, high_hz;
  double freedom;  // degrees of each density
  Density density;
};

using Piece = Eigen::Matrix<double, channels, Eigen::Dynamic>;

// Slope of a row over its samples.
double slope_of(const Piece& piece, Eigen::Index row) {
  const auto n = static_cast<double>(piece.cols());
  const Eigen::RowVectorXd time = Eigen::RowVectorXd::LinSpaced(piece.cols(), -0.5 * (n - 1.0), 0.5 * (n - 1.0));
  return piece.row(row).dot(time) / (n * (n * n - 1.0) / 12.0);
}

// Increments and angles of n samples, less their means. A gyro's constant drift is no tilt: the angles have the slope of the force.
Piece piece_of(const ImuData& data, const Base& base, std::size_t at, std::size_t n) {
  Piece piece(channels, static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    piece.col(column).head<3>() = Vector3(data.delta_theta[at + i].data());
    piece.col(column).segment<3>(3) = Vector3(data.delta_v[at + i].data());
  }
  piece.topRows<first_angle>().colwise() -= piece.topRows<first_angle>().rowwise().mean().eval();
  for (std::size_t k = 0; k < base.axes.size(); ++k) {
    const Eigen::RowVectorXd rate = base.axes[k].about.transpose() * piece.topRows<3>(),
                             force = base.axes[k].across.transpose() * piece.middleRows<3>(3);
    const Eigen::Index row = first_angle + static_cast<Eigen::Index>(k);
    double angle = 0.0;
    for (Eigen::Index i = 0; i < piece.cols(); ++i) {
      piece(row, i) = angle + 0.5 * rate(i);  // in the middle of the sample, where the force is
      angle += rate(i);
    }
    Piece both = Piece::Zero(channels, piece.cols());
    both.row(0) = force * data.sample_rate_hz / base.g;
    const double less = slope_of(piece, row) - slope_of(both, 0);
    for (Eigen::Index i = 0; i < piece.cols(); ++i) {
      piece(row, i) -= less * static_cast<double>(i);
    }
    piece.row(row).array() -= piece.row(row).mean();
  }
  return piece;
}

Eigen::Matrix<Complex, channels, Eigen::Dynamic> transformed(const Piece& piece, const Eigen::RowVectorXd& window) {
  Eigen::Matrix<Complex, channels, Eigen::Dynamic> lines(channels, piece.cols());
  Eigen::FFT<double> fft;
  std::vector<double> row(static_cast<std::size_t>(piece.cols()));
  std::vector<Complex> line;
  for (Eigen::Index k = 0; k < channels; ++k) {
    Eigen::Map<Eigen::RowVectorXd>(row.data(), piece.cols()) = piece.row(k).cwiseProduct(window);
    fft.fwd(line, row);
    lines.row(k) = Eigen::Map<const Eigen::RowVectorXcd>(line.data(), piece.cols());
  }
  return lines;
}

// Bins [first, last) of pieces of n samples that overlap by half.
std::vector<Bin> spectra_of(const ImuData& data, const Base& base, const std::vector<Stretch>& stretches, std::size_t n,
                            std::size_t first, std::size_t last) {
  Eigen::RowVectorXd hann(static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    const double turn = 2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n);
    hann(static_cast<Eigen::Index>(i)) = 0.5 - 0.5 * std::cos(turn);
  }
  const double bin_hz = data.sample_rate_hz / static_cast<double>(n);
  // Mean square of the window is 3/8; rates are increments times the sampling rate.
  const double scale = 2.0 * data.sample_rate_hz / (0.375 * static_cast<double>(n));
  std::vector<Bin> bins;
  for (std::size_t k = first; k < last; ++k) {
    const auto middle = static_cast<double>(k);
    bins.push_back({(middle - 0.5) * bin_hz, (middle + 0.5) * bin_hz, 0.0, Density::Zero()});
  }
  double pieces = 0.0, independent = 0.0;
  for (const Stretch& stretch : stretches) {
    const double before = pieces;
    for (std::size_t at = stretch.first; at + n <= stretch.last; at += (n + 1) / 2) {
      const Eigen::Matrix<Complex, channels, Eigen::Dynamic> lines = transformed(piece_of(data, base, at, n), hann);
      for (std::size_t k = first; k < last; ++k) {
        const Line line = lines.col(static_cast<Eigen::Index>(k));
        bins[k - first].density += scale * line * line.adjoint();
      }
      pieces += 1.0;
    }
    // Neighbours under Hann windows share 1/36 of their variance.
    const double own = pieces - before;
    independent += own > 0.0 ? own / (1.0 + 2.0 / 36.0 * (1.0 - 1.0 / own)) : 0.0;
  }
  for (Bin& bin : bins) {
    bin.density /= std::max(1.0, pieces);
    bin.freedom = 2.0 * independent;
  }
  return bins;
}

// Lengths fall by four from the longest stretch to pieces that most stretches hold, of 40 s at most; each length from its third bin
// on, the longest from its first, up to the third bin of the next.
std::vector<Bin> all_bins(const ImuData& data, const Base& base, const std::vector<Stretch>& stretches) {
  constexpr std::size_t shortest = 64, lowest = 3, ratio = 4, round = 32;
  constexpr double longest_of_short_s = 40.0;
  std::vector<std::size_t> sizes;
  sizes.reserve(stretches.size());
  for (const Stretch& s : stretches) {
    sizes.push_back(s.size());
  }
  std::sort(sizes.begin(), sizes.end());
  if (sizes.empty() || sizes.back() < shortest) {
    return {};
  }
  const double median = static_cast<double>(std::max(shortest, sizes[sizes.size() / 2]));
  const double most = std::min(median, longest_of_short_s * data.sample_rate_hz);
  const auto finest = static_cast<std::size_t>(std::exp2(std::floor(std::log2(most))));
  std::vector<std::size_t> lengths;
  for (std::size_t n = sizes.back() / round * round; n > ratio * finest; n = n / ratio / round * round) {
    lengths.push_back(n);
  }
  lengths.push_back(finest);
  std::vector<Bin> bins;
  std::size_t from = 1;
  for (std::size_t k = 0; k < lengths.size(); ++k) {
    const bool last = k + 1 == lengths.size();
    const std::size_t to = last ? lengths[k] / 2 : std::max(from + 1, lowest * lengths[k] / lengths[k + 1]);
    for (const Bin& bin : spectra_of(data, base, stretches, lengths[k], from, to)) {
      bins.push_back(bin);
    }
    from = last ? from : std::max<std::size_t>(1, (to * lengths[k + 1] + lengths[k] / 2) / lengths[k]);
  }
  for (std::size_t k = 0; k + 1 < bins.size(); ++k) {
    bins[k + 1].low_hz = bins[k].high_hz;  // seams between lengths
  }
  bins.front().low_hz = 0.0;
  bins.back().high_hz = 0.5 * data.sample_rate_hz;
  return bins;
}

struct Value {
  double low_hz, high_hz, freedom, density;
};

// Whether what these bins scatter by is chance: twice the logarithm of the likelihood of one density against one for each, which has
// n - 1 degrees of freedom (Bartlett's test). Neighbours share 4/9 under a Hann window, which widens its scatter by 1.4.
bool alike(const std::vector<Value>& values, std::size_t first, std::size_t last, double mean) {
  constexpr double neighbours = 1.4, sigmas = 3.0;
  double statistic = 0.0, expected = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    const double ratio = values[k].density / mean;
    if (!(ratio > 0.0)) {
      return false;
    }
    statistic += values[k].freedom * (ratio - 1.0 - std::log(ratio));
    expected += 1.0 + 1.0 / (3.0 * values[k].freedom / 2.0);
  }
  const auto degrees = static_cast<double>(last - first - 1);
  return statistic <= expected * degrees / (degrees + 1.0) + sigmas * neighbours * std::sqrt(2.0 * degrees);
}

void put_together(const std::vector<Value>& values, std::size_t first, std::size_t last, DensityTable& table) {
  double weight = 0.0, mean = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    const double width = values[k].high_hz - values[k].low_hz;
    weight += width;
    mean += width * values[k].density;
  }
  mean /= weight;
  const bool octave = values[last - 1].high_hz <= 2.0 * std::max(values[first].low_hz, values[first].high_hz);
  if (last - first == 1 || (octave && alike(values, first, last, mean))) {
    table.edges_hz.push_back(values[last - 1].high_hz);
    table.density.push_back(std::sqrt(mean));
    return;
  }
  const std::size_t middle = (first + last) / 2;
  put_together(values, first, middle, table);
  put_together(values, middle, last, table);
}

DensityTable table_of(const std::vector<Value>& values) {
  DensityTable table;
  if (!values.empty()) {
    table.edges_hz = {values.front().low_hz};
    put_together(values, 0, values.size(), table);
  }
  return table;
}

// Where the gyros' angle is tilt of the base: its density, rad^2/Hz, and what the accelerometers feel beside it, (m/s^2)^2/Hz.
struct TiltBin {
  double density = 0.0, beside = 0.0;
};
struct Tilt {
  std::vector<TiltBin> bins;  // from the lowest on
  double above_m = 0.0;       // sensors above the axis that the base turns about
};

// Angle phi and horizontal force over g, in each bin. About an axis h below the sensors the force is g phi - h d2(phi)/dt2, so that
// force = (1 + w^2 h/g) angle.
struct Together {
  double u, angle, force, cross;  // w^2/g, densities, real part of the cross-density
};

std::vector<Together> together_of(const std::vector<Bin>& bins, const Base& base, double rate_hz, std::size_t axis) {
  // The spectra are those of increments times the rate: an angle's has the rate too much.
  Line angle = Line::Zero(), force = Line::Zero();
  angle(first_angle + static_cast<Eigen::Index>(axis)) = 1.0 / rate_hz;
  force.segment<3>(3) = base.axes[axis].across.cast<Complex>() / base.g;
  std::vector<Together> all;
  for (const Bin& bin : bins) {
    const double w = std::numbers::pi * (bin.low_hz + bin.high_hz);
    all.push_back({w * w / base.g, std::real(angle.dot(bin.density * angle)), std::real(force.dot(bin.density * force)),
                   std::real(angle.dot(bin.density * force))});
  }
  return all;
}

// Share of the force's density that no one gain of the angle makes, bin by bin; of the bins around it, each by its own size.
double unlike_at(const std::vector<Together>& all, std::size_t k) {
  constexpr std::size_t around = 2;
  double cross = 0.0, angle = 0.0, force = 0.0;
  for (std::size_t i = k > around ? k - around : 0; i < std::min(all.size(), k + around + 1); ++i) {
    const double whole = all[i].angle + all[i].force;
    cross += all[i].cross / whole;
    angle += all[i].angle / whole;
    force += all[i].force / whole;
  }
  return cross > 0.0 ? 1.0 - cross * cross / (angle * force) : 1.0;
}

Tilt tilt_of(const std::vector<Bin>& bins, const Base& base, double rate_hz, std::size_t axis) {
  const std::vector<Together> all = together_of(bins, base, rate_hz, axis);
  constexpr double most_unlike = 0.3, least_unlike = 1e-6, clear = 0.1;
  constexpr std::size_t enough = 8;  // chance makes so many in no recording
  std::vector<double> weight;        // over the density of what is not of one motion
  for (std::size_t k = 0; k < all.size() && unlike_at(all, k) <= most_unlike; ++k) {
    const double unlike = unlike_at(all, k);
    weight.push_back(unlike <= clear ? 1.0 / (all[k].force * std::max(least_unlike, unlike)) : 0.0);
  }
  Tilt tilt;
  if (weight.size() < enough) {
    return tilt;
  }
  // Least squares for gain and h. Noise of the gyros makes a gain of the angle too small, noise of the force that of its inverse:
  // where both are far apart, h is not known.
  constexpr double apart = 0.25;
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d along = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const Eigen::Vector2d column(1.0, all[k].u);
    square += weight[k] * all[k].angle * column * column.transpose();
    along.col(0) += weight[k] * all[k].cross * column;
    along.col(1) += weight[k] * all[k].angle * all[k].force / all[k].cross * column;
  }
  const Eigen::Matrix2d both = square.ldlt().solve(along);
  const bool known = std::abs(both(1, 1) - both(1, 0)) < apart * std::abs(both(1, 0));
  const Eigen::Vector2d fitted = known ? Eigen::Vector2d(both.col(0)) : Eigen::Vector2d(1.0, 0.0);
  tilt.above_m = fitted(1);
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const double gain = fitted(0) + fitted(1) * all[k].u;
    const double beside = all[k].force - 2.0 * gain * all[k].cross + gain * gain * all[k].angle;
    tilt.bins.push_back({all[k].angle, base.g * base.g * beside});
  }
  return tilt;
}

TiltSpectrum tilt_spectrum(const std::vector<Bin>& bins, const Tilt& tilt) {
  std::vector<Value> values;
  for (std::size_t k = 0; k < tilt.bins.size(); ++k) {
    values.push_back({bins[k].low_hz, bins[k].high_hz, bins[k].freedom, tilt.bins[k].density});
  }
  return {table_of(values), tilt.above_m};
}

Base base_of(const ImuData& data, const Stretch& stretch) {
  Vector3 f = Vector3::Zero();
  for (std::size_t i = stretch.first; i < stretch.last; ++i) {
    f += Vector3(data.delta_v[i].data()) * data.sample_rate_hz / static_cast<double>(stretch.size());
  }
  // x of b made level, and across it. A turn by a small angle about a changes f by -a x f.
  const Vector3 up = f.normalized(), forward = (Vector3::UnitX() - up.x() * up).normalized(), level = up.cross(forward);
  constexpr double sine_of_11_deg = 0.2;
  return {f.norm(), std::abs(up.x()) < sine_of_11_deg, {{{forward, level}, {level, -forward}}}};
}

// Of one sensor axis: what is neither tilt nor its count.
DensityTable sensor_table(const std::vector<Bin>& bins, const Base& base, const std::array<Tilt, 2>& tilt,
                          Eigen::Index axis, double quantum, double rate_hz) {
  std::vector<Value> values;
  for (std::size_t k = 0; k < bins.size(); ++k) {
    // Tilt is left to the base: of the gyros' rate and of the force what is across its axes, and of the force what is beside it. Axes of
    // a base that leans are not quite the sensors': what a sensor has of another's is not taken for its own.
    Vector3 kept = Vector3::Unit(axis % 3);
    double own = 0.0;
    for (std::size_t a = 0; a < tilt.size(); ++a) {
      if (k < tilt[a].bins.size()) {
        const Vector3& felt = axis < 3 ? base.axes[a].about : base.axes[a].across;
        const double along = felt(axis % 3);
        kept -= along * felt;
        own += axis < 3 ? 0.0 : along * along * tilt[a].bins[k].beside;
      }
    }
    Line line = Line::Zero();
    (axis < 3 ? line.head<3>() : line.segment<3>(3)) = kept.cast<Complex>();
    own += std::real(line.dot(bins[k].density * line));
    // Increments of a count whose remainder is carried on differ by white noise of quantum^2/12 at either end.
    const double sine = std::sin(0.5 * std::numbers::pi * (bins[k].low_hz + bins[k].high_hz) / rate_hz);
    const double counted = 8.0 * rate_hz * quantum * quantum / 12.0 * sine * sine;
    values.push_back({bins[k].low_hz, bins[k].high_hz, bins[k].freedom, std::max(0.0, own - counted)});
  }
  return table_of(values);
}

}  // namespace

std::optional<NoiseSpectra> noise_spectra(const ImuData& data, const std::vector<Segment>& segments,
                                          double gyro_quantum, double accel_quantum) {
  const std::vector<Stretch> stretches = quiet_stretches(data, segments);
  if (stretches.empty()) {
    return std::nullopt;
  }
  const Base base = base_of(data, stretches.front());
  const bool parked = std::none_of(segments.begin(), segments.end(), [](const Segment& s) { return s.rotation; });
  CoherentLines coherent =
      parked ? CoherentLines{{}, CorrectedRecording(data)} : coherent_lines(data, as_segments(stretches));
  const std::vector<Bin> bins = all_bins(coherent.without.data(), base, stretches);
  if (bins.empty()) {
    return std::nullopt;
  }
  std::array<Tilt, 2> tilt;
  NoiseSpectra spectra;
  spectra.lines = std::move(coherent.lines);
  if (parked && base.level) {
    for (std::size_t axis = 0; axis < tilt.size(); ++axis) {
      tilt[axis] = tilt_of(bins, base, data.sample_rate_hz, axis);
      (axis == 0 ? spectra.roll : spectra.pitch) = tilt_spectrum(bins, tilt[axis]);
    }
  }
  for (Eigen::Index axis = 0; axis < first_angle; ++axis) {
    spectra.sensors[static_cast<std::size_t>(axis)] =
        sensor_table(bins, base, tilt, axis, axis < 3 ? gyro_quantum : accel_quantum, data.sample_rate_hz);
  }
  return spectra;
}

}  // namespace selfcal::diagnosis
