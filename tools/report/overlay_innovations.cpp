#include "tools/report/overlay_innovations.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/diagnosis/noise/loudness.hpp"
#include "estimator/diagnosis/noise/noise_check.hpp"
#include "estimator/diagnosis/noise/velocity_noise.hpp"
#include "estimator/diagnosis/regression/linear_model.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/passes/pass.hpp"
#include "tools/report/overlay_bands.hpp"

namespace selfcal::report {
namespace {

constexpr std::size_t axes = 3;
constexpr std::size_t most_lags = 30;
constexpr std::size_t part_size = 60;  // a minute
constexpr std::array<const char*, axes> axis_names = {"north", "up", "east"};

struct Innovations {
  std::vector<double> time_s;
  std::array<std::vector<double>, axes> value;        // over their predicted sigma
  std::array<std::vector<double>, axes> correlation;  // at lags 0, 1, ...
};

std::vector<double> less_mean(std::vector<double> x) {
  double mean = 0.0;
  for (const double v : x) {
    mean += v / static_cast<double>(x.size());
  }
  for (double& v : x) {
    v -= mean;
  }
  return x;
}

std::vector<double> correlations(const std::vector<double>& values, std::size_t lags) {
  const std::vector<double> x = less_mean(values);
  std::vector<double> r(lags + 1, 0.0);
  for (std::size_t k = 0; k <= lags; ++k) {
    for (std::size_t i = k; i < x.size(); ++i) {
      r[k] += x[i] * x[i - k];
    }
  }
  for (std::size_t k = lags + 1; k-- > 0;) {
    r[k] /= r[0];
  }
  return r;
}

Innovations innovations_of(const PassInput& input) {
  const PassOutput pass = run_pass(input);
  Innovations all;
  for (const Epoch& e : pass.epochs) {
    all.time_s.push_back(e.time_s);
    for (std::size_t a = 0; a < axes; ++a) {
      const auto row = static_cast<Eigen::Index>(a);
      all.value[a].push_back(e.innovation(row) / std::sqrt(e.variance(row)));
    }
  }
  for (std::size_t a = 0; a < axes; ++a) {
    all.correlation[a] = correlations(all.value[a], 2 * most_lags);
  }
  return all;
}

// Beside a coarse quantum the noise that the diagnosis fits, and the point where passes in it end: about that of the calibration, tens of
// mrad of heading away, a misfit of the second order stands in all lags. False: nothing turned, or no such quantum.
bool in_noise_of_beats(PassInput& input) {
  if (!diagnosis::turned(*input.data)) {
    return false;
  }
  const std::vector<Segment> segments = find_segments(*input.data);
  const diagnosis::NoiseCheck check = diagnosis::check_noise(*input.data, observed(segments, *input.data));
  return diagnosis::colours_innovations(input, check) &&
         diagnosis::fit_velocity_noise_and_point(input, check, segments);
}

// What shook the recording shakes no simulation, but one that is drawn as loud as the recording was at each time.
bool simulated_loudness(const ImuData& simulation) {
  constexpr double interval_s = 1.0;
  return diagnosis::changes_its_loudness(diagnosis::loudness_of(simulation, find_segments(simulation), interval_s));
}

// Where nothing turned the 24 are open and the heading is hardly known: the simulation's calibration may have walked anywhere (once 1e11 of the
// innovations' square). An amended simulation stands as the recording does, with perfect sensors: about that point, if it is the likelier.
PassInput likelier(const PassInput& simulation, const PassInput& recording) {
  PassInput as_recorded = simulation;
  as_recorded.parameters.setZero();
  as_recorded.C_nb = recording.C_nb;
  return run_pass(as_recorded).log_likelihood > run_pass(simulation).log_likelihood ? as_recorded : simulation;
}

// What chance makes of a correlation at lag k (Bartlett 1946), times n. `r`: those of both series, zero where chance makes them.
double bartlett(const std::vector<double>& r, std::size_t k) {
  const auto at = [&](std::size_t lag) { return lag < r.size() ? r[lag] : 0.0; };
  double sum = 0.0;
  for (std::size_t j = 1; j < r.size(); ++j) {
    const double term = at(k + j) + at(k > j ? k - j : j - k) - 2.0 * at(k) * at(j);
    sum += term * term;
  }
  return sum;
}

// Mean of both, without what chance makes.
std::vector<double> common(const std::vector<double>& a, const std::vector<double>& b, std::size_t n) {
  std::vector<double> r(a.size());
  for (std::size_t k = 0; k < r.size(); ++k) {
    r[k] = 0.5 * (a[k] + b[k]);
    r[k] = std::abs(r[k]) > 2.0 / std::sqrt(2.0 * static_cast<double>(n)) ? r[k] : 0.0;
  }
  return r;
}

// Of how many values one is worth: of squares, or of what is counted.
double inflation(const std::vector<double>& r, double power) {
  double sum = 1.0;
  for (std::size_t k = 1; k < r.size(); ++k) {
    sum += 2.0 * std::pow(std::abs(r[k]), power);
  }
  return sum;
}

// Products at lag k of each minute's innovations, less their mean, with those k later, over their squares.
std::vector<Part> parts_of_correlation(const std::vector<double>& x, std::size_t k) {
  std::vector<Part> parts(x.size() / part_size);
  for (std::size_t i = 0; i < parts.size() * part_size; ++i) {
    Part& part = parts[i / part_size];
    part.sum += i + k < x.size() ? x[i] * x[i + k] : 0.0;
    part.count += x[i] * x[i];
  }
  return parts;
}

OverlayCurve autocorrelation(const Innovations& a, const Innovations& b, std::size_t axis) {
  OverlayCurve curve{OverlayKind::innovations,
                     std::string("correlation-") + axis_names[axis],
                     std::string("innovations ") + axis_names[axis],
                     "lag",
                     "s",
                     "correlation",
                     "1",
                     false,
                     {}};
  const std::size_t n = std::min(a.time_s.size(), b.time_s.size());
  const std::vector<double> r = common(a.correlation[axis], b.correlation[axis], n);
  const std::vector<double> of_a = less_mean(a.value[axis]), of_b = less_mean(b.value[axis]);
  for (std::size_t k = 1; k <= std::min(most_lags, n / 10); ++k) {
    const double one = bartlett(r, k);
    const auto variance = [&](const std::vector<double>& x) {
      return std::max(one / static_cast<double>(x.size()), variance_of_mean(parts_of_correlation(x, k)));
    };
    curve.points.push_back(difference_point(static_cast<double>(k), a.correlation[axis][k], b.correlation[axis][k],
                                            variance(of_a) + variance(of_b)));
  }
  return curve;
}

// Squares of a minute's innovations, in pieces of six seconds: of bursts there are fewer than of innovations.
std::vector<Part> squares_of(const Innovations& all, std::size_t first) {
  constexpr std::size_t piece = 6;
  std::vector<Part> parts(part_size / piece);
  for (std::size_t i = 0; i < parts.size() * piece; ++i) {
    for (const std::vector<double>& value : all.value) {
      parts[i / piece].sum += value[first + i] * value[first + i];
      parts[i / piece].count += 1.0;
    }
  }
  return parts;
}

// Mean squares of a minute's innovations, each minute of the recording beside the same of the simulation.
OverlayCurve sizes(const Innovations& a, const Innovations& b) {
  OverlayCurve curve{
      OverlayKind::innovations, "sizes", "size of the innovations", "time", "s", "mean square", "1", true, {}};
  const std::size_t n = std::min(a.time_s.size(), b.time_s.size());
  double shared = 0.0;
  for (std::size_t axis = 0; axis < axes; ++axis) {
    shared += inflation(common(a.correlation[axis], b.correlation[axis], n), 2.0) / axes;
  }
  for (std::size_t first = 0; first + part_size <= n; first += part_size) {
    const std::vector<Part> own = squares_of(a, first), other = squares_of(b, first);
    const double size = mean_of(own), simulated = mean_of(other);
    const double scatter = variance_of_mean(own) / (size * size) + variance_of_mean(other) / (simulated * simulated);
    const double freedom = static_cast<double>(axes * part_size) / shared;
    curve.points.push_back(ratio_point(a.time_s[first + part_size / 2], size, simulated, freedom, freedom, scatter));
  }
  return curve;
}

// Bins of half a sigma, the outermost with all beyond; a bin counts where both hold ten.
OverlayCurve histogram(const Innovations& a, const Innovations& b) {
  constexpr double width = 0.5, farthest = 3.5;
  constexpr auto bins = static_cast<std::size_t>(2.0 * farthest / width);
  OverlayCurve curve{OverlayKind::histogram,
                     "histogram",
                     "histogram of the innovations",
                     "innovation over its sigma",
                     "1",
                     "share",
                     "1",
                     false,
                     {}};
  // Minute by minute, the last one longer.
  std::array<std::vector<Part>, bins> own, other;
  double shared = 0.0;
  const auto count = [&](const Innovations& all, std::array<std::vector<Part>, bins>& into) {
    const std::size_t minutes = std::max<std::size_t>(1, all.time_s.size() / part_size);
    into.fill(std::vector<Part>(minutes));
    for (const std::vector<double>& values : all.value) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double at = std::clamp((values[i] + farthest) / width, 0.0, static_cast<double>(bins) - 0.5);
        const std::size_t minute = std::min(minutes - 1, i / part_size);
        into.at(static_cast<std::size_t>(at))[minute].sum += 1.0;
        for (std::vector<Part>& bin : into) {
          bin[minute].count += 1.0;
        }
      }
    }
  };
  count(a, own);
  count(b, other);
  const auto n_own = static_cast<double>(axes * a.time_s.size()), n_other = static_cast<double>(axes * b.time_s.size());
  for (std::size_t axis = 0; axis < axes; ++axis) {
    const std::size_t n = std::min(a.time_s.size(), b.time_s.size());
    shared += inflation(common(a.correlation[axis], b.correlation[axis], n), 1.0) / axes;
  }
  constexpr double enough = 10.0;
  for (std::size_t k = 0; k < bins; ++k) {
    const double share = mean_of(own.at(k)), simulated = mean_of(other.at(k));
    const double p = (share * n_own + simulated * n_other) / (n_own + n_other);
    if (p * (n_own + n_other) < 2.0 * enough) {
      continue;
    }
    const auto variance = [&](const std::vector<Part>& parts, double n) {
      return std::max(shared * p * (1.0 - p) / n, variance_of_mean(parts));
    };
    curve.points.push_back(difference_point(width * (static_cast<double>(k) + 0.5) - farthest, share, simulated,
                                            variance(own.at(k), n_own) + variance(other.at(k), n_other)));
  }
  return curve;
}

}  // namespace

std::vector<OverlayCurve> overlay_innovations(const ImuData& recording, const CalibrationResult& of_recording,
                                              const ImuData& simulation, const CalibrationResult& of_simulation) {
  PassInput own = diagnosis::forward_pass(recording, of_recording);
  const bool of_beats = in_noise_of_beats(own);
  PassInput other = diagnosis::forward_pass(simulation, of_simulation);
  other.noise = own.noise;
  const bool as_loud = simulated_loudness(simulation);
  if (!as_loud) {
    other.noise.shaken.clear();
  }
  other.force = own.force;
  if (of_beats) {
    other.held = own.held;
    diagnosis::settle(other);
  } else {
    other.noise.disturbed = as_loud ? of_simulation.noise.disturbed : std::vector<Disturbance>{};
    other = likelier(other, own);
  }
  const Innovations a = innovations_of(own), b = innovations_of(other);
  constexpr std::size_t enough = 100;
  if (a.time_s.size() < enough || b.time_s.size() < enough) {
    return {};
  }
  std::vector<OverlayCurve> curves;
  for (std::size_t axis = 0; axis < axes; ++axis) {
    curves.push_back(autocorrelation(a, b, axis));
  }
  curves.push_back(sizes(a, b));
  curves.push_back(histogram(a, b));
  return curves;
}

}  // namespace selfcal::report
