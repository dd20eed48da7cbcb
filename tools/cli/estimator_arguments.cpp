#include "tools/cli/estimator_arguments.hpp"

#include <fmt/format.h>

#include <charconv>
#include <set>
#include <span>

#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/toml_file/nearest_word.hpp"

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

void NoiseArguments::add_to(Options& options) {
  options.number("--arw", arw_deg_per_sqrt_h, range::arw,
                 "gyro angle random walk, deg/sqrt(h); else found in the data");
  options.number("--vrw", vrw_ug_per_sqrt_hz, range::vrw,
                 "accelerometer velocity random walk, ug/sqrt(Hz); else found");
  options.number("--position-noise", position_sigma_m, range::position_noise,
                 "1 sigma of the known position at 1 Hz, m; else found");
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

Expected<std::vector<std::size_t>> parameters_called(std::string_view name, const std::string& option, Units allowed) {
  std::vector<std::size_t> called;
  std::vector<std::string> covered;
  std::set<std::string_view> units, known;
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    const std::string_view parameter = sensor_parameters[k].name;
    known.insert(parameter);
    known.insert(parameter.substr(0, parameter.rfind('_')));  // its group
    if (in_group(parameter, name)) {
      called.push_back(k);
      units.insert(sensor_parameters[k].unit);
      covered.push_back(fmt::format("{} ({})", parameter, sensor_parameters[k].unit));
    }
  }
  if (called.empty()) {
    const std::vector<std::string_view> words(known.begin(), known.end());
    return fail(ErrorKind::usage, fmt::format("{}: no parameter or group is called {}{}", option, name,
                                              did_you_mean(name, std::span<const std::string_view>(words))));
  }
  if (units.size() > 1 && allowed == Units::one) {
    return fail(ErrorKind::usage,
                fmt::format("{}: {} are parameters of different units: {}", option, name, fmt::join(covered, ", ")));
  }
  return called;
}

Expected<ParameterVector> tolerance_from(const std::vector<std::string>& arguments) {
  ParameterVector tolerance = default_tolerance();
  for (const std::string& argument : arguments) {
    const std::size_t equals = argument.find('=');
    const auto value =
        equals == std::string::npos ? std::nullopt : positive_number(std::string_view(argument).substr(equals + 1));
    if (!value) {
      return fail(ErrorKind::usage, fmt::format("--tolerance {}: NAME=VALUE with VALUE > 0 expected", argument));
    }
    const auto called = parameters_called(std::string_view(argument).substr(0, equals), "--tolerance " + argument);
    if (!called) {
      return tl::unexpected(called.error());
    }
    for (const std::size_t k : *called) {
      tolerance[static_cast<Eigen::Index>(k)] = *value * sensor_parameters[k].si_per_unit;
    }
  }
  return tolerance;
}

}  // namespace selfcal::cli
