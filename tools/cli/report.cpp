// selfcal report: a recording's calibration as one self-contained HTML page.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/calibration/calibrate_recording.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/recording_file.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/estimator_arguments.hpp"
#include "tools/report/report.hpp"

namespace selfcal::cli {
namespace {

struct ReportArguments {
  std::string recording;
  std::string output;
  std::vector<std::string> tolerance;
  NoiseArguments noise;
};

Expected<int> write_report(const ReportArguments& arguments) {
  CalibrationOptions options;
  options.noise = arguments.noise.in_si();
  const Expected<ParameterVector> tolerance = tolerance_from(arguments.tolerance);
  if (!tolerance) {
    return tl::unexpected(tolerance.error());
  }
  options.tolerance = *tolerance;
  const Expected<LoadedRecording> loaded = read_recording(arguments.recording);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  const Expected<CalibrationResult> result = calibrate_recording(loaded->recording, options);
  if (!result) {
    return fail(result.error().kind, fmt::format("{}: {}", arguments.recording, result.error().message));
  }
  const std::string page =
      report::report_page(report::report_document(*result, options, loaded->recording, loaded->warnings));
  // The page is the answer, whatever it says; `estimate` has the status that a script asks for.
  return write_file_atomically(arguments.output, page).map([] { return 0; });
}

CommandRun configure(CLI::App& app) {
  auto arguments = std::make_shared<ReportArguments>();
  app.add_option("RECORDING", arguments->recording, "HDF5 recording, or CSV with its TOML file")->required();
  app.add_option("-o,--output", arguments->output, "HTML file to write")->required();
  app.add_option("--tolerance", arguments->tolerance, "NAME=VALUE, as for estimate");
  arguments->noise.add_to(app);
  return [arguments] { return write_report(*arguments); };
}

const CommandRegistration registration{{"report", "a calibration as one HTML page with plots", configure}};

}  // namespace
}  // namespace selfcal::cli
