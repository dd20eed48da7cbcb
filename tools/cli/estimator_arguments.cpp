#include "tools/cli/estimator_arguments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>

#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::cli {
namespace {

bool in_group(std::string_view parameter, std::string_view name) {
  return parameter == name || (parameter.starts_with(name) && parameter.substr(name.size()).starts_with('_'));
}

std::optional<double> positive_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc{} && end == text.data() + text.size();
  return whole && value > 0.0 && value < 1e12 ? std::optional<double>{value} : std::nullopt;
}

}  // namespace

void NoiseArguments::add_to(CLI::App& app) {
  app.add_option("--arw", arw_deg_per_sqrt_h, "gyro angle random walk, deg/sqrt(h); else found in the data")
      ->check(CLI::PositiveNumber);
  app.add_option("--vrw", vrw_ug_per_sqrt_hz, "accelerometer velocity random walk, ug/sqrt(Hz); else found")
      ->check(CLI::PositiveNumber);
  app.add_option("--position-noise", position_sigma_m, "1 sigma of the known position at 1 Hz, m; else found")
      ->check(CLI::PositiveNumber);
}

NoiseOptions NoiseArguments::in_si() const {
  NoiseOptions noise;
  if (arw_deg_per_sqrt_h) {
    noise.gyro_arw = *arw_deg_per_sqrt_h * units::degree_per_sqrt_hour;
  }
  if (vrw_ug_per_sqrt_hz) {
    noise.accel_vrw = *vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz;
  }
  noise.position_sigma = position_sigma_m;
  return noise;
}

Expected<ParameterVector> tolerance_from(const std::vector<std::string>& arguments) {
  ParameterVector tolerance = default_tolerance();
  for (const std::string& argument : arguments) {
    const std::size_t equals = argument.find('=');
    const std::string_view name = std::string_view(argument).substr(0, equals);
    const auto value =
        equals == std::string::npos ? std::nullopt : positive_number(std::string_view(argument).substr(equals + 1));
    if (!value) {
      return fail(ErrorKind::usage, fmt::format("--tolerance {}: NAME=VALUE with VALUE > 0 expected", argument));
    }
    bool found = false;
    for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
      if (in_group(sensor_parameters[k].name, name)) {
        tolerance[static_cast<Eigen::Index>(k)] = *value * sensor_parameters[k].si_per_unit;
        found = true;
      }
    }
    if (!found) {
      return fail(ErrorKind::usage, fmt::format("--tolerance {}: no parameter or group is named {}", argument, name));
    }
  }
  return tolerance;
}

}  // namespace selfcal::cli
