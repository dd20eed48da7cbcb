// selfcal poses: diagnosis of sensors turned by hand or by a table between static poses: no Earth rate. What `diagnose` says
// of a recording that supports no more, and of raw counts.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "protocol/document/document_head.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/convert.hpp"
#include "tools/cli/poses_input.hpp"
#include "tools/cli/poses_output.hpp"

namespace selfcal::cli {
namespace {

struct PosesArguments {
  std::string file;
  double gyro_unit = 1.0;
  double false_alarm_rate = 0.01;
  bool json = false;
};

Expected<int> diagnose_by_poses(const PosesArguments& arguments) {
  const bool is_recording = arguments.file.ends_with(".h5") || arguments.file.ends_with(".hdf5");
  Expected<diagnosis::PoseInput> input =
      is_recording
          ? read_hdf5(arguments.file, lenient).map([](const auto& loaded) { return pose_input_of(loaded.recording); })
          : read_raw_poses(arguments.file);
  if (!input) {
    return tl::unexpected(input.error());
  }
  input->gyro_unit = arguments.gyro_unit;
  const diagnosis::PoseDiagnosis d = diagnosis::diagnose_poses(*input, arguments.false_alarm_rate);
  if (!d.failure.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", arguments.file, d.failure));
  }
  if (arguments.json) {
    const Expected<document::InputFile> file = document::identify_file(arguments.file);
    if (!file) {
      return tl::unexpected(file.error());
    }
    fmt::print("{}\n", document::with_head(document::poses, poses_json(d), *file).dump());
  } else {
    fmt::print("{}", poses_text(d, is_recording));
  }
  return poses_mismatch(d) ? 1 : 0;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<PosesArguments>();
  options.text("FILE", arguments->file,
               "CSV with a header: time in s, gyros x y z, accelerometers x y z, raw; or a recording (.h5)",
               Needed::yes);
  options.number("--gyro-unit", arguments->gyro_unit, range::gyro_unit, "nominal rad/s of one raw unit of the gyros");
  options.number("--false-alarm-rate", arguments->false_alarm_rate, range::false_alarm_rate, "of the whole diagnosis");
  options.flag("--json", arguments->json, "one JSON document on standard output");
  return [arguments] { return diagnose_by_poses(*arguments); };
}

const CommandRegistration registration{
    {"poses", "which physics a hand-turned sensor shows in static poses", configure}};

}  // namespace
}  // namespace selfcal::cli
