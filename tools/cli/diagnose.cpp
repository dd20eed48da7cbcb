// selfcal diagnose: where recording and model differ, which physics was left out, and the proof.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/calibration/calibrate_recording.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/recording_file.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "tools/cli/amendment.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/diagnose_output.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

struct DiagnoseArguments {
  std::string recording;
  std::string physics;
  std::string amended;
  bool json = false;
  double false_alarm_rate = 0.01;
  double arw_deg_per_sqrt_h = 0.001, vrw_ug_per_sqrt_hz = 5.0;
  double gyro_lsb_arcsec = 0.1, accel_lsb_mps = 2e-6;
};

Expected<int> diagnose(const DiagnoseArguments& arguments) {
  CheckPolicy policy;
  policy.gaps_are_errors = false;
  policy.gimbal_contradiction_is_error = false;
  const Expected<LoadedRecording> loaded = read_recording(arguments.recording, policy);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  for (const std::string& warning : loaded->warnings) {
    fmt::print(stderr, "selfcal diagnose: warning: {}: {}\n", arguments.recording, warning);
  }
  diagnosis::DiagnosisOptions options;
  options.false_alarm_rate = arguments.false_alarm_rate;
  options.assumed = {arguments.arw_deg_per_sqrt_h * units::degree_per_sqrt_hour,
                     arguments.vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz,
                     arguments.gyro_lsb_arcsec * units::arcsecond, arguments.accel_lsb_mps};
  std::vector<double> first_temperature;
  const ImuData data = imu_view(loaded->recording, first_temperature);
  const diagnosis::DiagnosisOutcome outcome = [&] {
    ProgressLine line;
    return diagnosis::diagnose(data, options, [&line](const std::string& words) { line.show(words); });
  }();
  if (!outcome.diagnosis) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", arguments.recording, outcome.failure));
  }
  if (arguments.json) {
    fmt::print("{}\n", diagnosis_json(*outcome.diagnosis, arguments.false_alarm_rate).dump());
  } else {
    fmt::print("{}", diagnosis_text(*outcome.diagnosis));
  }
  if (!arguments.physics.empty()) {
    const std::string text = physics_text(*outcome.diagnosis, options.assumed, data.site.latitude);
    if (const auto written = write_file_atomically(arguments.physics, text); !written) {
      return tl::unexpected(written.error());
    }
  }
  if (!arguments.amended.empty()) {
    const auto written =
        write_amendment(arguments.amended, *outcome.diagnosis, options.assumed, loaded->recording, data);
    if (!written) {
      return tl::unexpected(written.error());
    }
  }
  return outcome.diagnosis->mismatch ? 1 : 0;
}

CommandRun configure(CLI::App& app) {
  auto arguments = std::make_shared<DiagnoseArguments>();
  app.add_option("RECORDING", arguments->recording, "HDF5 recording, or CSV with its TOML file")->required();
  app.add_flag("--json", arguments->json, "one JSON document on standard output");
  app.add_option("--physics", arguments->physics, "write what was named as a physics file for the simulation");
  app.add_option("--amended", arguments->amended,
                 "write physics.toml, sim.toml (with the 24 as fitted) and schedule.toml into this folder");
  app.add_option("--false-alarm-rate", arguments->false_alarm_rate, "of a whole recording")
      ->check(CLI::Range(1e-6, 0.2))
      ->capture_default_str();
  app.add_option("--arw", arguments->arw_deg_per_sqrt_h, "angle random walk the simulation assumes, deg/sqrt(h)")
      ->capture_default_str();
  app.add_option("--vrw", arguments->vrw_ug_per_sqrt_hz, "velocity random walk it assumes, ug/sqrt(Hz)")
      ->capture_default_str();
  app.add_option("--gyro-lsb", arguments->gyro_lsb_arcsec, "quantum of the gyros it assumes, arcsec")
      ->capture_default_str();
  app.add_option("--accel-lsb", arguments->accel_lsb_mps, "quantum of the accelerometers it assumes, m/s")
      ->capture_default_str();
  return [arguments] { return diagnose(*arguments); };
}

const CommandRegistration registration{{"diagnose", "which physics a recording holds beyond the model", configure}};

}  // namespace
}  // namespace selfcal::cli
