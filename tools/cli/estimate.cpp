// selfcal estimate: the 24 sensor errors of a recording.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "daemon/estimate/judged_result.hpp"
#include "daemon/estimate/result_json.hpp"
#include "daemon/estimate/result_table.hpp"
#include "protocol/recording/recording_file.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/estimator_arguments.hpp"
#include "tools/cli/sound_part.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

struct EstimateArguments {
  std::string recording;
  bool json = false;
  bool curves = false;
  bool no_diagnosis = false;
  bool strict = false;
  std::string covariance = "once";
  std::uint64_t max_passes = static_cast<std::uint64_t>(CalibrationOptions{}.max_passes);
  double convergence_sigma = CalibrationOptions{}.convergence_sigma;
  std::vector<std::string> tolerance;
  NoiseArguments noise;
};

Expected<CalibrationOptions> options_from(const EstimateArguments& arguments) {
  CalibrationOptions options;
  options.noise = arguments.noise.in_si();
  options.max_passes = static_cast<int>(arguments.max_passes);
  options.convergence_sigma = arguments.convergence_sigma;
  options.carried_covariance = arguments.covariance == "carried";
  const Expected<ParameterVector> tolerance = tolerance_from(arguments.tolerance);
  if (!tolerance) {
    return tl::unexpected(tolerance.error());
  }
  options.tolerance = *tolerance;
  return options;
}

std::string progress_text(const CalibrationProgress& progress) {
  return fmt::format("pass {} {}: {:3.0f} %", progress.pass,
                     progress.direction == PassDirection::forward ? "forward" : "reverse", 100.0 * progress.fraction);
}

Expected<int> estimate(const EstimateArguments& arguments) {
  const Expected<CalibrationOptions> options = options_from(arguments);
  if (!options) {
    return tl::unexpected(options.error());
  }
  const CheckPolicy policy{.gaps_are_errors = arguments.strict};
  const Expected<LoadedRecording> loaded = read_recording(arguments.recording, policy);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  const Expected<std::unique_ptr<SoundPart>> sound = sound_part(loaded->recording, arguments.strict);
  if (!sound) {
    return fail(sound.error().kind, fmt::format("{}: {}", arguments.recording, sound.error().message));
  }
  for (const std::string& warning : loaded->warnings) {
    fmt::print(stderr, "selfcal estimate: warning: {}: {}\n", arguments.recording, warning);
  }
  const Expected<JudgedResult> judged = [&] {
    ProgressLine line;
    const JudgedProgress progress{[&line](const CalibrationProgress& p) { line.show(progress_text(p)); },
                                  [&line](const std::string& step) { line.show("looking for the cause: " + step); }};
    return judged_calibration(loaded->recording, *options, {}, {arguments.recording, 0}, !arguments.no_diagnosis,
                              progress, {}, *sound ? &(*sound)->aside : nullptr);
  }();
  if (!judged) {
    return fail(judged.error().kind, fmt::format("{}: {}", arguments.recording, judged.error().message));
  }
  if (arguments.json) {
    const Expected<document::InputFile> input = document::identify_file(arguments.recording);
    if (!input) {
      return tl::unexpected(input.error());
    }
    fmt::print("{}\n",
               result_json_text(*judged, *options, loaded->recording, loaded->warnings, arguments.curves, *input));
  } else {
    fmt::print("{}", result_table(*judged, *options, loaded->recording, use_colour(stdout), text_columns(stdout)));
  }
  return judged->gate.acceptable() ? 0 : 1;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<EstimateArguments>();
  options.text("RECORDING", arguments->recording, "HDF5 recording, or CSV with its TOML file", Needed::yes);
  options.flag("--json", arguments->json, "one JSON document on standard output");
  options.flag("--curves", arguments->curves, "with --json: convergence within the passes, and the correlations");
  options.flag("--no-diagnosis", arguments->no_diagnosis,
               "do not look for the cause where recording and model disagree (some seconds)");
  add_strict_option(options, arguments->strict);
  arguments->noise.add_to(options);
  options.choice("--covariance", arguments->covariance, {"once", "carried"},
                 "once: every datum counts once; carried: kept from pass to pass (overconfident, for comparison)");
  options.whole("--max-passes", arguments->max_passes, range::passes, "stop after so many passes");
  options.number("--convergence", arguments->convergence_sigma, range::convergence,
                 "stop when no parameter moves by more than this fraction of its sigma");
  options.texts("--tolerance", arguments->tolerance,
                "NAME=VALUE: sigma beyond which a parameter (gyro_scale_y) or group (gyro_scale) is not determined");
  return [arguments] { return estimate(*arguments); };
}

const CommandRegistration registration{{"estimate", "the 24 sensor errors of a recording", configure}};

}  // namespace
}  // namespace selfcal::cli
