// selfcal poses: diagnosis of sensors that stand, or are turned by hand or by a table between static poses: no Earth rate. What `diagnose` says
// of a recording that supports no more, and of raw counts.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "protocol/document/document_head.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/convert.hpp"
#include "tools/cli/log_angles.hpp"
#include "tools/cli/means_table.hpp"
#include "tools/cli/poses_attitude.hpp"
#include "tools/cli/poses_input.hpp"
#include "tools/cli/poses_output.hpp"

namespace selfcal::cli {
namespace {

constexpr WholeRange known_columns{1, 1000}, column_or_none{0, 1000};

struct PosesArguments {
  std::vector<std::string> files;
  std::string gyros, angle_file;
  std::optional<double> latitude_deg, height_m, rate_hz;
  double gyro_unit = 1.0;
  double false_alarm_rate = 0.01;
  bool json = false, details = false;
  std::string only, gyro_columns, accelerometer_columns;
  std::optional<std::uint64_t> angle_column, rate_column, temperature_column;
  AttitudeChoice attitude;
};

RawColumns raw_columns(const PosesArguments& arguments) {
  RawColumns columns;
  if (!arguments.only.empty()) {
    columns.sensors = arguments.only == "gyros" ? diagnosis::Sensors::gyros : diagnosis::Sensors::accelerometers;
  }
  columns.rate_hz = arguments.rate_hz;
  columns.raw_gyros = arguments.gyro_unit != 1.0;
  columns.gyros = arguments.gyro_columns;
  columns.accelerometers = arguments.accelerometer_columns;
  columns.angle = arguments.angle_file.empty() ? static_cast<std::size_t>(arguments.angle_column.value_or(0)) : 0;
  columns.turn_rate = static_cast<std::size_t>(arguments.rate_column.value_or(0));
  columns.table_by_names = arguments.angle_file.empty() && !arguments.angle_column && !arguments.rate_column;
  columns.temperature = static_cast<std::size_t>(arguments.temperature_column.value_or(0));
  return columns;
}

// What says how a log's columns stand says nothing of a recording, whose datasets have names.
Expected<void> check_arguments(const PosesArguments& arguments, bool is_recording) {
  if (arguments.files.empty()) {
    return fail(ErrorKind::usage, "FILE: a log or a recording is needed");
  }
  const bool of_columns = !arguments.only.empty() || arguments.angle_column || arguments.rate_column ||
                          arguments.temperature_column || !arguments.gyros.empty() || !arguments.angle_file.empty() ||
                          arguments.rate_hz || !arguments.gyro_columns.empty() ||
                          !arguments.accelerometer_columns.empty() || arguments.latitude_deg || arguments.height_m;
  if (is_recording && (of_columns || arguments.files.size() > 1)) {
    return fail(ErrorKind::usage,
                fmt::format("{}: a recording is given alone: --only, --gyros, --rate, --latitude, --height and columns "
                            "are of logs",
                            arguments.files.front()));
  }
  if (!arguments.gyros.empty() && (arguments.files.size() > 1 || !arguments.only.empty())) {
    return fail(ErrorKind::usage, "--gyros: with one FILE of accelerometers");
  }
  if (arguments.rate_column && (arguments.angle_column || !arguments.angle_file.empty())) {
    return fail(ErrorKind::usage,
                "--rate-column: with --angle-column or --angle-file one of both would be left unread");
  }
  if (!arguments.angle_file.empty() && (arguments.files.size() > 1 || arguments.rate_hz)) {
    return fail(ErrorKind::usage, "--angle-file: with one FILE that holds its times");
  }
  const bool attitude_asked = !arguments.attitude.file.empty() || !arguments.attitude.columns.empty();
  if (attitude_asked && (arguments.files.size() > 1 || arguments.rate_hz)) {
    return fail(ErrorKind::usage, "--attitude: with one FILE that holds its times");
  }
  if (arguments.height_m && !arguments.latitude_deg) {
    return fail(ErrorKind::usage, "--height: without --latitude it says nothing of gravity");
  }
  return {};
}

// A recording holds none itself.
Expected<void> add_attitude(const PosesArguments& arguments, bool is_recording, RawLog& log) {
  const std::string& name = arguments.files.front();
  if (is_recording && arguments.attitude.file.empty()) {
    return arguments.attitude.columns.empty()
               ? Expected<void>()
               : fail(ErrorKind::usage,
                      fmt::format("{}: --attitude-columns are of a log or of --attitude's file; a recording "
                                  "holds no attitude",
                                  name));
  }
  if (arguments.files.size() > 1 || arguments.rate_hz) {
    return {};  // times that the attitude does not have
  }
  auto chosen = choose_attitude(name, log, arguments.attitude);
  if (!chosen) {
    return tl::unexpected(chosen.error());
  }
  if (!chosen->notes.empty()) {
    fmt::print(stderr, "selfcal poses: {}\n", chosen->notes);
  }
  log.input.attitude = std::move(chosen->attitude);
  return {};
}

Expected<int> tell(const PosesArguments& arguments, const diagnosis::PoseDiagnosis& d, bool si) {
  const std::string& name = arguments.files.front();
  if (!d.failure.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", name, d.failure));
  }
  if (arguments.json) {
    const Expected<document::InputFile> file = document::identify_file(name);
    if (!file) {
      return tl::unexpected(file.error());
    }
    fmt::print("{}\n", document::with_head(document::poses, poses_json(d), *file).dump());
  } else {
    fmt::print("{}", arguments.details ? poses_details(d, si) : poses_summary(d, si) + "more: --details\n");
  }
  return poses_mismatch(d) ? 1 : 0;
}

void print_notes(const std::string& file, const std::string& notes) {
  if (!notes.empty()) {
    fmt::print(stderr, "selfcal poses: {}: {}\n", file, notes);
  }
}

Expected<int> diagnose_by_poses(const PosesArguments& arguments) {
  const auto is_hdf5 = [](const std::string& f) {
    return (f.ends_with(".h5") || f.ends_with(".hdf5")) && !is_foreign_hdf5(f);
  };
  const bool is_recording = std::any_of(arguments.files.begin(), arguments.files.end(), is_hdf5);
  if (const auto good = check_arguments(arguments, is_recording); !good) {
    return tl::unexpected(good.error());
  }
  const std::string& name = arguments.files.front();
  const RawFiles files{arguments.files, arguments.gyros, arguments.latitude_deg, arguments.height_m};
  if (!is_recording && arguments.angle_file.empty()) {
    const auto table = answer_of_table(files, raw_columns(arguments), arguments.gyro_unit, arguments.false_alarm_rate);
    if (!table) {
      return tl::unexpected(table.error());
    }
    if (*table) {
      if ((*table)->diagnosis.failure.empty()) {
        print_notes(name, (*table)->notes);
      }
      return tell(arguments, (*table)->diagnosis, (*table)->si);
    }
  }
  Expected<RawLog> log = is_recording ? read_hdf5(name, lenient).map([](const auto& loaded) {
    return RawLog{pose_input_of(loaded.recording), true, 0.0L, false, {}};
  })
                                      : read_raw_poses(files, raw_columns(arguments));
  if (!log) {
    return tl::unexpected(log.error());
  }
  if (!arguments.angle_file.empty()) {
    const auto column = static_cast<std::size_t>(arguments.angle_column.value_or(0));
    if (const auto added = add_angles(arguments.angle_file, column, name, *log); !added) {
      return tl::unexpected(added.error());
    }
  }
  print_notes(name, log->notes);
  if (const auto added = add_attitude(arguments, is_recording, *log); !added) {
    return tl::unexpected(added.error());
  }
  log->input.gyro_unit = arguments.gyro_unit;
  diagnosis::PoseDiagnosis d = diagnosis::diagnose_poses(log->input, arguments.false_alarm_rate);
  if (log->nameless && !d.failure.empty()) {
    d.failure += "; without names the first three are taken for gyros: `selfcal import --guess` goes by the numbers";
  }
  return tell(arguments, d, log->si);
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<PosesArguments>();
  options.texts("FILE", arguments->files,
                "a log: columns by their names, else time in s, gyros x y z, accelerometers x y z; or a recording "
                "(.h5); several logs: one after the other, as of positions");
  options.choice("--only", arguments->only, {"gyros", "accelerometers"},
                 "gyros or accelerometers: the log holds these alone, time in s and then x y z; or one gyro");
  options.text("--gyros", arguments->gyros, "the gyros' own file, of a logger that writes one file a sensor");
  options.text("--gyro-columns", arguments->gyro_columns,
               "gyros x, y, z, of a log that holds several sets: numbers from 1 or names, commas between");
  options.text("--accelerometer-columns", arguments->accelerometer_columns, "accelerometers x, y, z, likewise");
  options.number("--rate", arguments->rate_hz, range::sample_rate, "rows a second, of a log without a time");
  options.number("--latitude", arguments->latitude_deg, range::latitude, "of the place, deg: gravity, Earth's rate");
  options.number("--height", arguments->height_m, range::height, "of the place, m");
  options.whole(
      "--angle-column", arguments->angle_column, column_or_none,
      "the CSV's column, from 1, that holds the angle of a table with one axis, deg; 0: none, whatever names say");
  options.whole("--rate-column", arguments->rate_column, column_or_none,
                "the CSV's column, from 1, that holds the rate of a table with one axis, deg/s; 0 likewise");
  options.text("--angle-file", arguments->angle_file,
               "the table's own log with its time and its angle, of which --angle-column then says the column");
  options.whole("--temperature-column", arguments->temperature_column, known_columns,
                "the CSV's column, from 1, that holds a temperature, degC");
  options.text(
      "--attitude", arguments->attitude.file,
      "a file with the attitude that something else measured, and its time; the log itself: take its columns for that");
  options.text(
      "--attitude-columns", arguments->attitude.columns,
      "its columns, numbers from 1 or names, commas between: 4 of a quaternion, 3 roll pitch yaw, 9 of a matrix");
  options.number("--gyro-unit", arguments->gyro_unit, range::gyro_unit, "nominal rad/s of one raw unit of the gyros");
  options.number("--false-alarm-rate", arguments->false_alarm_rate, range::false_alarm_rate, "of the whole diagnosis");
  options.flag("--details", arguments->details, "every test and every parameter");
  options.flag("--json", arguments->json, "one JSON document on standard output");
  return [arguments] { return diagnose_by_poses(*arguments); };
}

const CommandRegistration registration{
    {"poses", "which physics a sensor shows that stands, or is turned by hand", configure}};

}  // namespace
}  // namespace selfcal::cli
