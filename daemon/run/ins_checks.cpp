#include "daemon/run/ins_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/passes/calibration.hpp"

namespace selfcal {
namespace {

// A gimbal may be slower or faster from one position to the next than the schedule has it, by far less than this part of
// the whole time; and the last page is a part of one.
constexpr double pages_slack = 0.1;
constexpr double pages_rounding = 2.0;
// A part of a second at either end of the check.
constexpr double check_slack_s = 2.0;
// Two quartz clocks differ by 1e-4 of the time at the most; ten times that.
constexpr double clock_tolerance = 1e-3;
// An INS may say that it rotates while it still makes room in its FLASH, and while it writes the last page: 16 MiB in blocks
// of 64 KiB at 30 ms each take 8 s.
constexpr double make_room_s = 10.0;
// Free fall, which no platform at rest exceeds.
constexpr double gravity_mps2 = 9.81;

using Set = std::array<double, sensor_parameter_count>;

// In the parameter's unit.
double lost_of(const Set& wanted, const Set& held, std::size_t k) {
  return std::abs(held[k] - wanted[k]) / sensor_parameters[k].si_per_unit;
}

// The one that is lost by most of its tolerance.
std::size_t most_lost(const Set& wanted, const Set& held, const Set& tolerance) {
  std::size_t worst = 0;
  for (std::size_t k = 1; k < wanted.size(); ++k) {
    if (lost_of(wanted, held, k) * tolerance[worst] > lost_of(wanted, held, worst) * tolerance[k]) {
      worst = k;
    }
  }
  return worst;
}

}  // namespace

double pages_of(const Schedule& schedule, const ins::SampleFormatRecord& format) {
  return std::ceil(schedule.duration_s() * format.sample_rate_hz / format.samples_per_page);
}

bool holds_whole_rotation(const ins::DirectoryRecord& directory) {
  return directory.complete && directory.pages_expected > 0 && directory.pages_written == directory.pages_expected;
}

Complaint check_directory(const ins::DirectoryRecord& directory, const ins::SampleFormatRecord& format,
                          const Schedule& schedule, double longer_s) {
  const double pages = pages_of(schedule, format);
  const double longer = longer_s * format.sample_rate_hz / format.samples_per_page;
  const double most = (pages + longer) * (1.0 + pages_slack) + pages_rounding;
  const double least = pages * (1.0 - pages_slack) - pages_rounding;
  const std::string of_schedule = fmt::format("the schedule of {:.0f} s at {:g} Hz has {:.0f}", schedule.duration_s(),
                                              format.sample_rate_hz, pages);
  if (directory.pages_expected > most || directory.pages_expected < std::max(least, 1.0)) {
    return fmt::format("directory: {} pages expected, {}", directory.pages_expected, of_schedule);
  }
  if (directory.pages_written > most) {
    return fmt::format("directory: {} pages written, {}", directory.pages_written, of_schedule);
  }
  const std::uint64_t full = std::uint64_t{directory.pages_written} * format.samples_per_page;
  const std::uint64_t but_last = directory.pages_written == 0 ? 0 : full - format.samples_per_page + 1;
  if (directory.samples > full || directory.samples < but_last) {
    return fmt::format("directory: {} samples in {} pages of {}", directory.samples, directory.pages_written,
                       format.samples_per_page);
  }
  return std::nullopt;
}

Complaint check_rotation_time(const ins::DirectoryRecord& directory, const ins::SampleFormatRecord& format,
                              const RotationTime& took, const InsConfig& config) {
  const double data_s = static_cast<double>(directory.samples) / format.sample_rate_hz;
  const auto complaint = [&](std::string_view bound, double seconds) {
    return fmt::format("directory: {} samples at {:g} Hz are {:.1f} s of data, but the rotation took {} {:.1f} s",
                       directory.samples, format.sample_rate_hz, data_s, bound, seconds);
  };
  const double age_s = config.request_timeout_s * config.time_scale;
  const double most_s = took.most_s.value_or(0.0) * config.time_scale;
  if (took.most_s && data_s > most_s * (1.0 + clock_tolerance) + age_s) {
    return complaint("at most", most_s);
  }
  if (config.time_scale == 1.0 && data_s < took.least_s * (1.0 - clock_tolerance) - age_s - make_room_s) {
    return complaint("at least", took.least_s);
  }
  return std::nullopt;
}

Complaint check_coefficients(const std::array<double, sensor_parameter_count>& value, std::string_view whose) {
  const ParameterVector limit = plausible_limit();
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    const SensorParameter& parameter = sensor_parameters[i];
    const double most = limit(static_cast<Eigen::Index>(i));
    if (!(std::abs(value[i]) <= most)) {
      return fmt::format("{}: {} = {:g} {}, physically possible are {:g} at most", whose, parameter.name,
                         value[i] / parameter.si_per_unit, parameter.unit, most / parameter.si_per_unit);
    }
  }
  return std::nullopt;
}

// Free-inertial navigation with an error of so many millionths of g in a level accelerometer: g / omega^2 (1 - cos(omega t)), omega
// Schuler's.
double drift_m(double lost_ug, double seconds) {
  constexpr double earth_radius_m = 6.371e6;
  const double omega = std::sqrt(gravity_mps2 / earth_radius_m);
  return lost_ug * 1e-6 * earth_radius_m * (1.0 - std::cos(omega * seconds));
}

std::string words_of_loss(const std::array<double, sensor_parameter_count>& wanted,
                          const std::array<double, sensor_parameter_count>& held,
                          const std::array<double, sensor_parameter_count>& tolerance) {
  constexpr double worth_saying = 1e-3, ten_minutes_s = 600.0;
  const std::size_t worst = most_lost(wanted, held, tolerance);
  const double lost = lost_of(wanted, held, worst);
  if (!(lost > worth_saying * tolerance[worst])) {
    return {};
  }
  const SensorParameter& parameter = sensor_parameters[worst];
  // A scale factor of so many ppm is so many millionths of g at 1 g.
  const bool of_accel_scale = parameter.name.starts_with("accel_scale");
  return fmt::format("{}: {:.6g} {} were found, the INS holds {:.6g}{}", parameter.name,
                     wanted[worst] / parameter.si_per_unit, parameter.unit, held[worst] / parameter.si_per_unit,
                     of_accel_scale
                         ? fmt::format(": {:.3g} ug are lost at 1 g, {:.3g} m after 10 minutes of navigation", lost,
                                       drift_m(lost, ten_minutes_s))
                         : std::string());
}

Complaint check_held(const std::array<double, sensor_parameter_count>& wanted,
                     const std::array<double, sensor_parameter_count>& held,
                     const std::array<double, sensor_parameter_count>& tolerance) {
  const std::size_t worst = most_lost(wanted, held, tolerance);
  if (lost_of(wanted, held, worst) <= tolerance[worst]) {
    return std::nullopt;
  }
  return fmt::format("{}, and {:.3g} {} are tolerated: nothing is written", words_of_loss(wanted, held, tolerance),
                     tolerance[worst], sensor_parameters[worst].unit);
}

Complaint check_navigation(const ins::NavigationCheckRecord& answer, double asked_s) {
  if (answer.elapsed_s > asked_s + check_slack_s || (answer.done && answer.elapsed_s < asked_s - check_slack_s)) {
    return fmt::format("navigation check: {} after {:g} s, {:g} s were asked for", answer.done ? "done" : "going on",
                       answer.elapsed_s, asked_s);
  }
  const double farthest_m = 0.5 * gravity_mps2 * asked_s * asked_s;
  const double end_m = std::hypot(answer.north_m, answer.east_m);
  if (answer.max_horizontal_m > farthest_m) {
    return fmt::format("navigation check: {:g} m away at most, free fall takes {:g} m in {:g} s",
                       answer.max_horizontal_m, farthest_m, asked_s);
  }
  if (answer.done && end_m > answer.max_horizontal_m * (1.0 + 1e-6) + 1e-3) {
    return fmt::format("navigation check: {:g} m away in the end, {:g} m at most", end_m, answer.max_horizontal_m);
  }
  return std::nullopt;
}

}  // namespace selfcal
