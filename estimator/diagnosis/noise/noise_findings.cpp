#include "estimator/diagnosis/noise/noise_findings.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::diagnosis {
namespace {

// Densities and quanta are judged beyond 5 sigma: their sigma is that of a fit to smoothed spectra, and good to some tens of
// per cent itself, so that 5 stand for 3 and more.
constexpr double least_sigma = 5.0;
constexpr double coarser = 2.0;  // a quantum by so much: what is less is noise of the electronics beside it

std::string axis_name(int axis) {
  std::string name = axis < 3 ? "gyro_" : "accel_";
  name += "xyz"[axis % 3];
  return name;
}

// 1 sigma of a triad's density over itself: what the fit states (gyros beside a quantum), or of a fit to the mean spectrum.
// Gyros: pieces of 32 s, accelerometers: of 3.2 s (sensor_noise.cpp); of each,
// three axes of 21 bins, of which the taper leaves a third independent, scatter by 1/sqrt(21 pieces) of the square;
// half of that in the density, twice that because white angle is fitted too. Below 3 % the model of the noise counts.
double relative_density_sigma(const CalibrationResult& calibration, bool gyro) {
  constexpr double least = 0.03;
  if (gyro && calibration.gyro_arw_sigma > 0.0) {
    return std::max(least, calibration.gyro_arw_sigma / calibration.gyro_arw);
  }
  double dwells_s = 0.0;
  for (const SegmentSummary& s : calibration.segments) {
    dwells_s += s.rotation ? 0.0 : s.end_s - s.start_s;
  }
  const double pieces = std::max(1.0, dwells_s / (gyro ? 32.0 : 3.2));
  return std::max(least, 1.0 / std::sqrt(21.0 * pieces));
}

// Of the filter, mean of the axes: a coarse quantum at a slow rate is far from white, and a fit to the whole spectrum of one
// axis takes it for noise. On a moored base the gyros' density hides behind the motion.
Finding density_of(const CalibrationResult& calibration, const NoiseModel& fitted, const AssumedNoise& assumed,
                   bool gyro) {
  Finding level;
  level.effect = gyro ? "gyro_noise_level" : "accel_noise_level";
  level.equation = "white noise of another density";
  const double expected = gyro ? assumed.gyro_arw : assumed.accel_vrw;
  const double unit = gyro ? units::degree_per_sqrt_hour : units::micro_g_per_sqrt_hz;
  const double density = gyro ? fitted.gyro_arw : fitted.accel_vrw;
  const double sigma = relative_density_sigma(calibration, gyro);
  const double z = (density / expected - 1.0) / sigma;
  const bool judged = expected > 0.0 && !(gyro && calibration.moored);
  if (judged && std::abs(z) > least_sigma) {
    level.parameters.push_back({"mean", gyro ? "deg/sqrt(h)" : "ug/sqrt(Hz)", density / unit, sigma * density / unit});
    level.log_p = log_normal_tail(z);
  }
  return level;
}

Finding quanta_of(const NoiseCheck& noise, const AssumedNoise& assumed, bool gyro, double log_threshold) {
  Finding coarse;
  coarse.effect = "quantisation";
  coarse.equation = "white noise of the integral of another size: quantum = sqrt(12) times";
  const double quantum = gyro ? assumed.gyro_quantum : assumed.accel_quantum;
  for (int axis = gyro ? 0 : 3; axis < (gyro ? 3 : 6); ++axis) {
    const AxisNoise& n = noise.axes[static_cast<std::size_t>(axis)];
    const double found = std::sqrt(12.0) * n.increment_sigma;
    const double excess = n.increment_sigma * n.increment_sigma - quantum * quantum / 12.0;
    const double z = excess / n.increment_variance_sigma;
    const double log_p = log_corrected(log_normal_tail(z), 6.0);
    if (quantum > 0.0 && found > coarser * quantum && z > least_sigma && log_p < log_threshold) {
      coarse.parameters.push_back(
          {axis_name(axis), gyro ? "arcsec" : "m/s", gyro ? found / units::arcsecond : found, 0.0});
      coarse.log_p = std::min(coarse.log_p, log_p);
    }
  }
  return coarse;
}

Finding line_of(const VibrationLine& line) {
  const bool gyro = line.axis < 3;
  Finding f;
  f.effect = "vibration_line";
  f.equation = "a sin(2 pi f t)";
  f.log_p = line.log_p;
  f.parameters = {{axis_name(line.axis), gyro ? "deg/h" : "ug",
                   line.amplitude / (gyro ? units::degree_per_hour : units::micro_g), 0.0},
                  {"frequency_hz", "Hz", line.frequency_hz, 0.0}};
  return f;
}

}  // namespace

std::vector<Finding> noise_findings(const CalibrationResult& calibration, const NoiseModel& fitted,
                                    const NoiseCheck& noise, const AssumedNoise& assumed, double log_threshold) {
  std::vector<Finding> all;
  if (noise.pieces < enough_noise_pieces) {
    return all;
  }
  for (const bool gyro : {true, false}) {
    all.push_back(density_of(calibration, fitted, assumed, gyro));
    all.push_back(quanta_of(noise, assumed, gyro, log_threshold));
  }
  std::erase_if(all, [](const Finding& f) { return f.parameters.empty(); });
  for (const VibrationLine& line : noise.lines) {
    // The beat of the gyro's quantum with a steady rate makes lines of an angle of up to quantum/pi.
    const double beat = line.axis < 3 ? 2.0 * line.frequency_hz * calibration.gyro_quantum : 0.0;
    if (line.log_p < log_threshold && !line.beat && line.amplitude > beat) {
      all.push_back(line_of(line));
    }
  }
  for (Finding& f : all) {
    f.significance = sigma_from_log_p(f.log_p);
    f.stochastic = true;
    f.excited = "dwells";
  }
  return all;
}

}  // namespace selfcal::diagnosis
