// selfcal poses: diagnosis of sensors that stand, or are turned by hand or by a table between static poses: no Earth rate. What `diagnose` says
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

constexpr WholeRange known_columns{1, 1000};

struct PosesArguments {
  std::string file;
  double gyro_unit = 1.0;
  double false_alarm_rate = 0.01;
  bool json = false;
  std::string only;
  std::optional<std::uint64_t> angle_column, temperature_column;
};

RawColumns raw_columns(const PosesArguments& arguments) {
  RawColumns columns;
  columns.sensors = arguments.only == "gyros"            ? diagnosis::Sensors::gyros
                    : arguments.only == "accelerometers" ? diagnosis::Sensors::accelerometers
                                                         : diagnosis::Sensors::both;
  columns.raw_gyros = arguments.gyro_unit != 1.0;
  columns.angle = static_cast<std::size_t>(arguments.angle_column.value_or(0));
  columns.temperature = static_cast<std::size_t>(arguments.temperature_column.value_or(0));
  return columns;
}

// What says how a CSV's columns stand says nothing of a recording, whose datasets have names.
Expected<void> check_columns(const PosesArguments& arguments, bool is_recording) {
  if (is_recording && (!arguments.only.empty() || arguments.angle_column || arguments.temperature_column)) {
    return fail(
        ErrorKind::usage,
        fmt::format("{}: --only, --angle-column and --temperature-column are of CSV of raw values", arguments.file));
  }
  return {};
}

Expected<int> diagnose_by_poses(const PosesArguments& arguments) {
  const bool is_recording = arguments.file.ends_with(".h5") || arguments.file.ends_with(".hdf5");
  if (const auto columns = check_columns(arguments, is_recording); !columns) {
    return tl::unexpected(columns.error());
  }
  Expected<RawLog> log = is_recording ? read_hdf5(arguments.file, lenient).map([](const auto& loaded) {
    return RawLog{pose_input_of(loaded.recording), true, {}};
  })
                                      : read_raw_poses(arguments.file, raw_columns(arguments));
  if (!log) {
    return tl::unexpected(log.error());
  }
  if (!log->notes.empty()) {
    fmt::print(stderr, "selfcal poses: {}: {}\n", arguments.file, log->notes);
  }
  log->input.gyro_unit = arguments.gyro_unit;
  const diagnosis::PoseDiagnosis d = diagnosis::diagnose_poses(log->input, arguments.false_alarm_rate);
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
    fmt::print("{}", poses_text(d, log->si));
  }
  return poses_mismatch(d) ? 1 : 0;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<PosesArguments>();
  options.text("FILE", arguments->file,
               "a log: columns by their names, else time in s, gyros x y z, accelerometers x y z; or a recording (.h5)",
               Needed::yes);
  options.choice("--only", arguments->only, {"gyros", "accelerometers"},
                 "gyros or accelerometers: the CSV holds these alone, time in s and then x y z");
  options.whole("--angle-column", arguments->angle_column, known_columns,
                "the CSV's column, from 1, that holds the angle of a table with one axis, deg");
  options.whole("--temperature-column", arguments->temperature_column, known_columns,
                "the CSV's column, from 1, that holds a temperature, degC");
  options.number("--gyro-unit", arguments->gyro_unit, range::gyro_unit, "nominal rad/s of one raw unit of the gyros");
  options.number("--false-alarm-rate", arguments->false_alarm_rate, range::false_alarm_rate, "of the whole diagnosis");
  options.flag("--json", arguments->json, "one JSON document on standard output");
  return [arguments] { return diagnose_by_poses(*arguments); };
}

const CommandRegistration registration{
    {"poses", "which physics a sensor shows that stands, or is turned by hand", configure}};

}  // namespace
}  // namespace selfcal::cli
