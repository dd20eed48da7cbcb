// selfcal plan: predicted sigma of the 24 before anything turns, and the search for a schedule.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/geometry/units.hpp"
#include "estimator/planning/plan.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/estimator_arguments.hpp"
#include "tools/cli/output_file.hpp"
#include "tools/cli/page_writer.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

struct PlanArguments {
  std::string schedule{default_schedule};
  std::optional<double> dwell_s;
  std::optional<double> rotation_s;
  std::vector<double> attitude_deg = {0.0, 0.0, 0.0};  // roll, pitch, heading
  double latitude_deg = 40.0;
  double height_m = 0.0;
  double arw_deg_per_sqrt_h = 0.001;
  double vrw_ug_per_sqrt_hz = 5.0;
  double position_sigma_m = Installation{}.position_sigma;
  std::vector<std::string> tolerance;
  std::vector<std::string> ignored;
  bool optimize = false;
  double longest_s = SearchOptions{}.longest_s;
  std::string output;
  std::string compared;  // a second schedule for the page
  bool json = false;
};

Expected<Installation> installation_from(const PlanArguments& a) {
  Installation installation;
  installation.attitude = {a.attitude_deg[0] * units::degree, a.attitude_deg[1] * units::degree,
                           a.attitude_deg[2] * units::degree};
  installation.site = {a.latitude_deg * units::degree, 0.0, a.height_m};
  installation.gyro_arw = a.arw_deg_per_sqrt_h * units::degree_per_sqrt_hour;
  installation.accel_vrw = a.vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz;
  installation.position_sigma = a.position_sigma_m;
  const Expected<ParameterVector> tolerance = tolerance_from(a.tolerance);
  if (!tolerance) {
    return tl::unexpected(tolerance.error());
  }
  installation.tolerance = *tolerance;
  for (const std::string& name : a.ignored) {
    const auto called = parameters_called(name, "--ignore " + name, Units::any);
    if (!called) {
      return tl::unexpected(called.error());
    }
    for (const std::size_t k : *called) {
      installation.tolerance(static_cast<Eigen::Index>(k)) = HUGE_VAL;
    }
  }
  return installation;
}

nlohmann::json schedule_json(const Schedule& schedule) {
  nlohmann::json positions = nlohmann::json::array();
  for (const GimbalPosition& p : schedule.positions) {
    positions.push_back({p.outer_deg, p.inner_deg});
  }
  return {{"positions", positions}, {"dwell_s", schedule.dwell_s}, {"rotation_s", schedule.rotation_s}};
}

nlohmann::json plan_json(const Plan& plan, const Schedule& schedule, const Installation& installation,
                         const std::vector<std::string>& warnings) {
  nlohmann::json parameters = nlohmann::json::array();
  for (int i = 0; i < sensor_parameter_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const SensorParameter& p = sensor_parameters[k];
    nlohmann::json entry = {{"name", p.name},
                            {"unit", p.unit},
                            {"sigma", plan.sigma(i) / p.si_per_unit},
                            {"determined", plan.determined[k]}};
    if (std::isfinite(installation.tolerance(i))) {
      entry["tolerance"] = installation.tolerance(i) / p.si_per_unit;
    }
    parameters.push_back(entry);
  }
  nlohmann::json history = nlohmann::json::array();
  for (const PositionForecast& forecast : plan.history) {
    nlohmann::json sigma = nlohmann::json::array();
    for (int i = 0; i < sensor_parameter_count; ++i) {
      sigma.push_back(forecast.sigma(i) / sensor_parameters[static_cast<std::size_t>(i)].si_per_unit);
    }
    history.push_back({{"end_s", forecast.end_s}, {"sigma", sigma}});
  }
  return {{"duration_s", plan.duration_s},
          {"parameters", parameters},
          {"schedule", schedule_json(schedule)},
          {"meets_tolerances", plan.meets_tolerances()},
          {"warnings", warnings},
          {"history", history}};
}

void print_table(const Plan& plan, const Schedule& schedule, const Installation& installation) {
  fmt::print("{} positions, {:.1f} min\n\n{:<24} {:>12} {:>12}\n", schedule.positions.size(), plan.duration_s / 60.0,
             "parameter", "sigma", "tolerance");
  for (int i = 0; i < sensor_parameter_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const SensorParameter& p = sensor_parameters[k];
    const std::string tolerance = std::isfinite(installation.tolerance(i))
                                      ? fmt::format("{:.4g}", installation.tolerance(i) / p.si_per_unit)
                                      : "-";
    fmt::print("{:<24} {:>12.4g} {:>12} {:<7}{}\n", p.name, plan.sigma(i) / p.si_per_unit, tolerance, p.unit,
               plan.determined[k] ? "" : " NOT MET");
  }
}

// What the operator should know before turning: what will not be determined, and whether another schedule would do.
std::vector<std::string> warnings_for(const Plan& plan, const Schedule& schedule, const Installation& installation) {
  std::vector<std::string> warnings;
  for (int i = 0; i < sensor_parameter_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!plan.determined[k]) {
      const SensorParameter& p = sensor_parameters[k];
      warnings.push_back(fmt::format("{}: sigma {:.3g} {} does not meet the tolerance of {:.3g}", p.name,
                                     plan.sigma(i) / p.si_per_unit, p.unit, installation.tolerance(i) / p.si_per_unit));
    }
  }
  if (warnings.empty()) {
    return warnings;
  }
  for (const UndeterminedDirection& direction : plan.undetermined) {
    warnings.push_back("weak direction, " + direction.words);
  }
  const double moves = static_cast<double>(schedule.positions.size()) - 1.0;
  const double mean_dwell = (schedule.duration_s() - moves * schedule.rotation_s) / (moves + 1.0);
  for (const char* name : {"horizontal", "table2"}) {
    const Plan other = predict(*named_schedule(name, mean_dwell, schedule.rotation_s), installation);
    const auto count = [](const Plan& p) { return std::count(p.determined.begin(), p.determined.end(), true); };
    if (count(other) > count(plan)) {
      warnings.push_back(fmt::format("better here: schedule '{}' with the same dwell determines {} of {} in {:.1f} min",
                                     name, count(other), sensor_parameter_count, other.duration_s / 60.0));
      break;
    }
  }
  return warnings;
}

// The page of this plan, beside the schedule that it is to be compared with.
Expected<void> write_page(const PlanArguments& a, report::PlannedSchedule planned, const Installation& installation) {
  if (plan_page_writer() == nullptr) {
    return fail(ErrorKind::usage, fmt::format("{}: this program was built without pages (npm was missing)", a.output));
  }
  std::vector<report::PlannedSchedule> schedules = {std::move(planned)};
  if (!a.compared.empty()) {
    Expected<Schedule> other = find_schedule(a.compared, a.dwell_s, a.rotation_s);
    if (!other) {
      return tl::unexpected(other.error());
    }
    const Plan plan = predict(*other, installation);
    const std::vector<std::string> warnings = warnings_for(plan, *other, installation);
    schedules.push_back({a.compared, *other, plan, plan_json(plan, *other, installation, warnings)});
  }
  return plan_page_writer()(schedules, installation, a.output);
}

Expected<void> write_output(const PlanArguments& a, const report::PlannedSchedule& planned,
                            const Installation& installation) {
  if (is_page(a.output)) {
    return write_page(a, planned, installation);
  }
  return write_file_atomically(a.output, format_schedule(planned.schedule));
}

Expected<int> plan(const PlanArguments& a) {
  const Expected<Installation> installation = installation_from(a);
  if (!installation) {
    return tl::unexpected(installation.error());
  }
  if (!a.output.empty()) {
    if (const auto known = check_output(a.output, {".html", ".pdf", ".toml"}); !known) {
      return tl::unexpected(known.error());
    }
  }
  if (!a.compared.empty() && !is_page(a.output)) {
    return fail(ErrorKind::usage, "--compare: for a page only (-o NAME.html or NAME.pdf)");
  }
  Schedule schedule;
  Plan result;
  if (a.optimize) {
    SearchOptions options;
    options.rotation_s = a.rotation_s.value_or(options.rotation_s);
    options.longest_s = a.longest_s;
    if (a.dwell_s) {
      options.dwells_s = {*a.dwell_s};
    }
    ProgressLine line;
    SearchResult found = search_schedule(*installation, options, [&line](double fraction) {
      line.show(fmt::format("searching: {:3.0f} %", 100.0 * fraction));
    });
    if (found.schedule.positions.empty()) {
      return fail(ErrorKind::usage, fmt::format("--longest {} s: too short for any schedule", a.longest_s));
    }
    schedule = std::move(found.schedule);
    result = std::move(found.plan);
  } else {
    Expected<Schedule> given = find_schedule(a.schedule, a.dwell_s, a.rotation_s);
    if (!given) {
      return tl::unexpected(given.error());
    }
    schedule = std::move(*given);
    result = predict(schedule, *installation);
  }
  const std::vector<std::string> warnings = warnings_for(result, schedule, *installation);
  if (!a.output.empty()) {
    const report::PlannedSchedule planned{a.optimize ? "optimized" : a.schedule, schedule, result,
                                          plan_json(result, schedule, *installation, warnings)};
    if (const auto written = write_output(a, planned, *installation); !written) {
      return tl::unexpected(written.error());
    }
  }
  if (a.json) {
    document::InputFile input;
    if (!a.optimize && !named_schedule(a.schedule)) {  // then it was read from a file
      const Expected<document::InputFile> file = document::identify_file(a.schedule);
      if (!file) {
        return tl::unexpected(file.error());
      }
      input = *file;
    }
    fmt::print(
        "{}\n",
        document::with_head(document::plan, plan_json(result, schedule, *installation, warnings), input).dump(1));
  } else {
    print_table(result, schedule, *installation);
    if (a.optimize) {
      fmt::print("\n{}", format_schedule(schedule));
    }
    for (const std::string& warning : warnings) {
      fmt::print("warning: {}\n", warning);
    }
  }
  return result.meets_tolerances() ? 0 : 1;
}

CommandRun configure(Options& options) {
  auto a = std::make_shared<PlanArguments>();
  options.text("--schedule", a->schedule, "table2, horizontal, or a TOML file");
  options.number("--dwell", a->dwell_s, range::dwell, "seconds at each position");
  options.number("--rotation", a->rotation_s, range::rotation, "seconds for each move");
  options.numbers("--attitude", a->attitude_deg, 3, range::angle, "of the vehicle: roll,pitch,heading in degrees");
  options.number("--latitude", a->latitude_deg, range::latitude, "degrees");
  options.number("--height", a->height_m, range::height, "metres above the ellipsoid");
  options.number("--arw", a->arw_deg_per_sqrt_h, range::arw, "angle random walk, deg/sqrt(h)");
  options.number("--vrw", a->vrw_ug_per_sqrt_hz, range::vrw, "velocity random walk, ug/sqrt(Hz)");
  options.number("--position-noise", a->position_sigma_m, range::position_noise, "of the known position, m at 1 Hz");
  options.texts("--tolerance", a->tolerance, "NAME=VALUE: sigma that a parameter or group must reach");
  options.texts("--ignore", a->ignored, "parameter or group whose tolerance does not count");
  options.flag("--optimize", a->optimize, "search the shortest schedule that meets the tolerances");
  options.number("--longest", a->longest_s, range::longest_schedule,
                 "with --optimize: no schedule beyond so many seconds");
  options.text("-o,--output", a->output,
               "file to write: .html or .pdf a page with plots, .toml the schedule, ready to run");
  options.text("--compare", a->compared,
               "with a page: a second schedule (table2, horizontal, or a TOML file) beside it");
  options.flag("--json", a->json, "one JSON document on standard output");
  return [a] { return plan(*a); };
}

const CommandRegistration registration{
    {"plan", "predicted accuracy of a schedule, or the shortest schedule that reaches one", configure}};

}  // namespace
}  // namespace selfcal::cli
