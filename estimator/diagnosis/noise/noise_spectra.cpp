#include "estimator/diagnosis/noise/noise_spectra.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <utility>

#include "estimator/diagnosis/noise/tilting_base.hpp"

namespace selfcal::diagnosis {
namespace {

using Complex = std::complex<double>;
using Line = Eigen::Matrix<Complex, tilt_channels, 1>;
using Density = Eigen::Matrix<Complex, tilt_channels, tilt_channels>;  // cross-spectra

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

Eigen::Matrix<Complex, tilt_channels, Eigen::Dynamic> transformed(const Piece& piece,
                                                                  const Eigen::RowVectorXd& window) {
  Eigen::Matrix<Complex, tilt_channels, Eigen::Dynamic> lines(tilt_channels, piece.cols());
  Eigen::FFT<double> fft;
  std::vector<double> row(static_cast<std::size_t>(piece.cols()));
  std::vector<Complex> line;
  for (Eigen::Index k = 0; k < tilt_channels; ++k) {
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
      const Eigen::Matrix<Complex, tilt_channels, Eigen::Dynamic> lines =
          transformed(piece_of(data, base, at, n), hann);
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

// Of a base that tilts, and what the accelerometers feel beside it in each bin from the lowest to where it ends, (m/s^2)^2/Hz.
struct Tilt {
  TiltSpectrum spectrum;
  std::vector<double> beside;
};

// The band that holds a frequency; none outside the table.
std::optional<std::size_t> band_at(const DensityTable& table, double hz) {
  const auto above = std::upper_bound(table.edges_hz.begin(), table.edges_hz.end(), hz);
  const bool inside = above != table.edges_hz.begin() && above != table.edges_hz.end();
  return inside ? std::optional(static_cast<std::size_t>(above - table.edges_hz.begin()) - 1) : std::nullopt;
}

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

// Least squares for gain and h of all bins. Noise of the gyros makes a gain of the angle too small, noise of the force that of its inverse:
// where both are far apart, h is not known, and none is taken.
double height_of(const std::vector<Together>& all, const std::vector<double>& weight) {
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
  return std::abs(both(1, 1) - both(1, 0)) < apart * std::abs(both(1, 0)) ? both(1, 0) : 0.0;
}

// The same of the bins [first, last): force less angle against angle times w^2/g. nullopt: worse known than 20 cm.
std::optional<double> height_between(const std::vector<Bin>& bins, const std::vector<Together>& all, std::size_t first,
                                     std::size_t last) {
  constexpr double well_known_m = 0.2, apart = 0.25;
  double information = 0.0, low = 0.0, high = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    const Together& t = all[k];
    const double beside = std::max(1e-6 * t.force, t.force - t.cross * t.cross / t.angle);
    const double one = bins[k].freedom * t.u * t.u * t.angle / beside;
    information += one;
    low += one * (t.cross / t.angle - 1.0) / t.u;
    high += one * (t.force / t.cross - 1.0) / t.u;
  }
  const bool known = information * well_known_m * well_known_m > 1.0 && std::abs(high - low) < apart * std::abs(low);
  return known ? std::optional(low / information) : std::nullopt;
}

// A vehicle rocks on its springs about another axis at each frequency. Bands of the table of which that is not known take the next one above
// or else below, and that of all where there is none.
std::vector<double> heights_of(const std::vector<Bin>& bins, const std::vector<Together>& all,
                               const std::vector<double>& weight, const DensityTable& table) {
  std::vector<std::optional<double>> known;
  std::size_t first = 0;
  for (std::size_t band = 0; band < table.density.size(); ++band) {
    std::size_t last = first;
    while (last < weight.size() && bins[last].low_hz < table.edges_hz[band + 1]) {
      ++last;
    }
    known.push_back(height_between(bins, all, first, last));
    first = last;
  }
  const auto top = std::find_if(known.rbegin(), known.rend(), [](const auto& h) { return h.has_value(); });
  double above = top != known.rend() ? **top : height_of(all, weight);
  std::vector<double> heights(known.size());
  for (std::size_t band = known.size(); band-- > 0;) {
    above = known[band].value_or(above);
    heights[band] = above;
  }
  return heights;
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
  std::vector<Value> values;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    values.push_back({bins[k].low_hz, bins[k].high_hz, bins[k].freedom, all[k].angle});
  }
  tilt.spectrum.table = table_of(values);
  tilt.spectrum.above_m = heights_of(bins, all, weight, tilt.spectrum.table);
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const double above_m = tilt.spectrum.above_m.at(band_at(tilt.spectrum.table, bins[k].low_hz).value());
    const double gain = 1.0 + above_m * all[k].u;
    const double beside = all[k].force - 2.0 * gain * all[k].cross + gain * gain * all[k].angle;
    tilt.beside.push_back(base.g * base.g * beside);
  }
  return tilt;
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
      if (k < tilt[a].beside.size()) {
        const Vector3& felt = axis < 3 ? base.axes[a].about : base.axes[a].across;
        const double along = felt(axis % 3);
        kept -= along * felt;
        own += axis < 3 ? 0.0 : along * along * tilt[a].beside[k];
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

// Loudness of each table, from all of the recording: what stands in it, over its density.
void add_loudness(const ImuData& data, const Base& base, const std::array<Tilt, 2>& tilt, NoiseSpectra& spectra) {
  const std::size_t n = quick_length(data.size());
  std::vector<std::vector<Complex>> lines;
  {
    const Piece whole = piece_of(data, base, 0, n);
    std::vector<double> series(n);
    for (Eigen::Index k = 0; k < tilt_channels; ++k) {
      // Sensors as rates.
      const double scale = k < first_angle ? data.sample_rate_hz : 1.0;
      Eigen::Map<Eigen::RowVectorXd>(series.data(), whole.cols()) = scale * whole.row(k);
      lines.push_back(mirrored_lines(series));
    }
  }
  const double line_hz = 0.5 * data.sample_rate_hz / static_cast<double>(n);
  const auto loudness = [&](const DensityTable& table, const auto& value_at) {
    std::vector<Complex> whitened(n + 1, 0.0);
    for (std::size_t k = 1; k < n; ++k) {
      const double hz = static_cast<double>(k) * line_hz;
      const auto band = band_at(table, hz);
      whitened[k] = band && table.density[*band] > 0.0 ? value_at(k, hz) / table.density[*band] : 0.0;
    }
    return loudness_of_bands(whitened, data.sample_rate_hz);
  };
  const auto triad = [&](std::size_t first, std::size_t k) {
    return Eigen::Vector3cd(lines[first][k], lines[first + 1][k], lines[first + 2][k]);
  };
  for (std::size_t axis = 0; axis < first_angle; ++axis) {
    const std::size_t first = axis < 3 ? 0 : 3;
    DensityTable& table = spectra.sensors[axis];
    table.loudness = loudness(table, [&](std::size_t k, double hz) {
      const Eigen::Vector3cd all = triad(first, k);
      Complex own = all(static_cast<Eigen::Index>(axis % 3));
      for (std::size_t a = 0; a < tilt.size(); ++a) {
        const Vector3& felt = axis < 3 ? base.axes[a].about : base.axes[a].across;
        if (const auto band = band_at(tilt[a].spectrum.table, hz)) {
          const double w = 2.0 * std::numbers::pi * hz, above_m = tilt[a].spectrum.above_m[*band];
          const Complex of_tilt =
              axis < 3 ? felt.cast<Complex>().dot(all) : (base.g + w * w * above_m) * lines[first_angle + a][k];
          own -= felt(static_cast<Eigen::Index>(axis % 3)) * of_tilt;
        }
      }
      return own;
    });
  }
  for (std::size_t a = 0; a < tilt.size(); ++a) {
    DensityTable& table = (a == 0 ? spectra.roll : spectra.pitch).table;
    table.loudness = loudness(table, [&](std::size_t k, double) { return lines[first_angle + a][k]; });
  }
}

}  // namespace

std::optional<NoiseSpectra> noise_spectra(const ImuData& data, const std::vector<Segment>& segments,
                                          double gyro_quantum, double accel_quantum) {
  const std::vector<Stretch> stretches = quiet_stretches(data, segments);
  if (stretches.empty()) {
    return std::nullopt;
  }
  const Base base = base_of(data, stretches.front().first, stretches.front().last);
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
      (axis == 0 ? spectra.roll : spectra.pitch) = tilt[axis].spectrum;
    }
  }
  for (Eigen::Index axis = 0; axis < first_angle; ++axis) {
    spectra.sensors[static_cast<std::size_t>(axis)] =
        sensor_table(bins, base, tilt, axis, axis < 3 ? gyro_quantum : accel_quantum, data.sample_rate_hz);
  }
  constexpr std::size_t most = 2'000'000;  // 5.5 h at 100 Hz: a simulation draws such noise at one time
  if (parked && data.size() <= most) {
    add_loudness(coherent.without.data(), base, tilt, spectra);
  }
  return spectra;
}

}  // namespace selfcal::diagnosis
