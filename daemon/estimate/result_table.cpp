#include "daemon/estimate/result_table.hpp"

#include <fmt/format.h>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

constexpr std::string_view red = "\033[31m";
constexpr std::string_view green = "\033[32m";
constexpr std::string_view plain = "\033[0m";

std::string coloured(std::string_view text, std::string_view shade, bool colour) {
  return colour ? fmt::format("{}{}{}", shade, text, plain) : std::string(text);
}

// Two significant digits of sigma, and the value to the same decimal.
int decimals_for(double sigma) {
  int decimals = 0;
  for (double scale = 10.0; decimals < 6 && sigma * scale < 100.0; scale *= 10.0) {
    ++decimals;
  }
  return decimals;
}

std::string parameter_row(const CalibrationResult& result, const CalibrationOptions& options, std::size_t k,
                          bool colour) {
  const SensorParameter& parameter = sensor_parameters[k];
  const auto row = static_cast<Eigen::Index>(k);
  const double sigma = result.sigma[row] / parameter.si_per_unit;
  const int decimals = decimals_for(sigma);
  const std::string_view mark = !result.plausible[k]    ? "not plausible"
                                : !result.determined[k] ? "not determined"
                                                        : "ok";
  const bool good = result.plausible[k] && result.determined[k];
  return fmt::format("{:<22} {:>12.{}f} {:>10.{}f} {:>10.4g}  {:<7} {}\n", parameter.name,
                     result.value[row] / parameter.si_per_unit, decimals, sigma, decimals,
                     options.tolerance[row] / parameter.si_per_unit, parameter.unit,
                     coloured(mark, good ? green : red, colour));
}

std::string passes_text(const CalibrationResult& result) {
  std::string text;
  int number = 0;
  for (const PassSummary& pass : result.passes) {
    text += fmt::format("pass {} {:<8} {:>7.0f} s  NIS {:.3f}  largest move {:.3g} sigma\n", ++number,
                        pass.direction == PassDirection::forward ? "forward" : "reverse", pass.seconds, pass.nis_mean,
                        pass.largest_move_sigma);
  }
  return text;
}

}  // namespace

std::string result_table(const CalibrationResult& result, const CalibrationOptions& options, const Recording& recording,
                         bool colour) {
  std::string text =
      fmt::format("{:<22} {:>12} {:>10} {:>10}  {:<7}\n", "parameter", "value", "sigma", "tolerance", "unit");
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    text += parameter_row(result, options, k, colour);
  }
  const Attitude& attitude = result.initial_attitude;
  text += fmt::format("\n{}: {} samples, {:.0f} s, answer in {:.2f} s\n",
                      recording.serial.empty() ? "no serial number" : recording.serial, recording.size(),
                      static_cast<double>(recording.size()) / recording.sample_rate_hz, result.elapsed_s);
  text += fmt::format("attitude at the start: roll {:.4f}, pitch {:.4f}, heading {:.4f} deg\n",
                      attitude.roll / units::degree, attitude.pitch / units::degree, attitude.heading / units::degree);
  text += fmt::format("{} base; noise in use: ARW {:.3g} deg/sqrt(h), VRW {:.3g} ug/sqrt(Hz), position {:.3g} m\n",
                      result.moored ? "moored" : "still", result.gyro_arw / units::degree_per_sqrt_hour,
                      result.accel_vrw / units::micro_g_per_sqrt_hz, result.position_sigma);
  text += passes_text(result);
  for (const UndeterminedDirection& direction : result.undetermined) {
    text += fmt::format("undetermined: {}\n", direction.words);
  }
  const bool good = acceptable(result);
  text += coloured(fmt::format("verdict: {}", result.consistency.words), good ? green : red, colour) + "\n";
  for (const std::string& objection : objections(result, options)) {
    text += fmt::format("  {}\n", objection);
  }
  return text;
}

}  // namespace selfcal
