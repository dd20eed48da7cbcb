// selfcal import: what people have, to a recording: by a map of its columns, guessed or written, or as CSV of our own form.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "protocol/import/build_recording.hpp"
#include "protocol/import/guess.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/csv.hpp"
#include "protocol/recording/file_hash.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/convert.hpp"
#include "tools/cli/import_as_run.hpp"
#include "tools/cli/output_file.hpp"

namespace selfcal::cli {
namespace {

constexpr std::size_t longest_map = 48 << 10;  // an HDF5 attribute holds 64 KiB

struct ImportArguments {
  std::string from;
  std::string to;
  std::string map;
  bool guess = false;
  std::string topic;
  import::GuessKnowledge known;
  bool as_run = false;
  AsRun run;
};

// Builds, checks, writes; then says what was done.
Expected<int> write_mapped(const import::ColumnSource& source, const import::ImportMap& map,
                           const std::string& map_text, const ImportArguments& arguments) {
  const Expected<import::Imported> imported = import::build_recording(source, map, arguments.from);
  if (!imported) {
    return tl::unexpected(imported.error());
  }
  const Recording& recording = imported->recording;
  const auto warnings = check_recording(recording, lenient);
  if (!warnings) {
    return fail(warnings.error().kind,
                fmt::format("{}, by {}: {}", arguments.from, map.name, warnings.error().message));
  }
  const Expected<std::string> hash = sha256_of_file(arguments.from);
  if (!hash) {
    return tl::unexpected(hash.error());
  }
  TextAttributes origin{{"source_file", std::filesystem::path(arguments.from).filename().string()},
                        {"source_sha256", *hash},
                        {"import_map", map_text},
                        {"import_notes", fmt::format("{}", fmt::join(imported->notes, "\n"))}};
  if (const auto written = write_hdf5(recording, arguments.to, origin); !written) {
    return tl::unexpected(written.error());
  }
  for (const std::string& warning : *warnings) {
    fmt::print(stderr, "selfcal import: warning: {}: {}\n", arguments.from, warning);
  }
  fmt::print("{}: {} samples at {} Hz, {:.6g} s\n", arguments.to, recording.size(), recording.sample_rate_hz,
             static_cast<double>(recording.size()) / recording.sample_rate_hz);
  for (const std::string& note : imported->notes) {
    fmt::print("  {}\n", note);
  }
  return 0;
}

Expected<int> import_by_map(const ImportArguments& arguments) {
  const Expected<std::string> text = read_text_file(arguments.map, longest_map);
  if (!text) {
    return tl::unexpected(text.error());
  }
  const Expected<import::ImportMap> map = import::parse_import_map(*text, arguments.map);
  if (!map) {
    return tl::unexpected(map.error());
  }
  const auto source = import::open_columns(arguments.from, map->dialect);
  if (!source) {
    return tl::unexpected(source.error());
  }
  return write_mapped(**source, *map, *text, arguments);
}

void print_remarks(const std::vector<import::Remark>& remarks, bool doubts) {
  const auto wanted = [doubts](const import::Remark& r) { return r.doubt == doubts; };
  if (std::none_of(remarks.begin(), remarks.end(), wanted)) {
    return;
  }
  fmt::print("{}\n", doubts ? "doubted" : "assumed");
  for (const import::Remark& remark : remarks) {
    if (wanted(remark)) {
      fmt::print("  {:22} {}\n", remark.key, remark.text);
    }
  }
}

std::string guessed_map_text(const import::Guess& guess, const import::ColumnSource& source, const std::string& from) {
  std::multimap<std::string, std::string> comments;
  for (const import::Remark& remark : guess.remarks) {
    comments.emplace(remark.key, remark.doubt ? fmt::format("DOUBT: {}", remark.text) : remark.text);
  }
  const std::string heading =
      fmt::format("# How `selfcal import` reads {}: {}.\n# Guessed; the lines above a key say from what.\n",
                  std::filesystem::path(from).filename().string(), source.form());
  return import::format_import_map(guess.map, comments, heading);
}

Expected<int> guess_and_import(const ImportArguments& arguments) {
  const std::string map_file =
      arguments.map.empty() ? std::filesystem::path(arguments.from).filename().string() + ".map.toml" : arguments.map;
  std::error_code ignored;
  if (std::filesystem::exists(map_file, ignored)) {
    return fail(ErrorKind::usage,
                fmt::format("{}: exists; --map names another file for the guess, and without --guess it is "
                            "used as it stands",
                            map_file));
  }
  if (const auto folder = check_folder(map_file); !folder) {
    return tl::unexpected(folder.error());
  }
  const auto source = import::open_columns(arguments.from, std::nullopt, arguments.topic);
  if (!source) {
    return tl::unexpected(source.error());
  }
  Expected<import::Guess> guess = import::guess_map(**source, arguments.known, arguments.from);
  if (!guess) {
    return tl::unexpected(guess.error());
  }
  const std::string text = guessed_map_text(*guess, **source, arguments.from);
  if (const auto written = write_file_atomically(map_file, text); !written) {
    return tl::unexpected(written.error());
  }
  fmt::print("{}: {}\n", arguments.from, (*source)->form());
  print_remarks(guess->remarks, false);
  print_remarks(guess->remarks, true);
  const std::size_t open = guess->map.unsettled.size();
  fmt::print("map: {}{}\n", map_file,
             open == 0 ? std::string(", nothing doubted")
                       : fmt::format("; {} to settle in it: {}", open, fmt::join(guess->map.unsettled, ", ")));
  if (open > 0) {
    fmt::print("then: selfcal import {} --map {} -o {}\n", arguments.from, map_file,
               arguments.to.empty() ? "REC.h5" : arguments.to);
    return 1;
  }
  if (arguments.to.empty()) {
    return 0;
  }
  const Expected<import::ImportMap> map = import::parse_import_map(text, map_file);
  if (!map) {
    return fail(ErrorKind::internal, map.error().message);
  }
  return write_mapped(**source, *map, text, arguments);
}

Expected<int> convert_to_recording(const ImportArguments& arguments) {
  if (arguments.to.empty() && !arguments.guess) {
    return fail(ErrorKind::usage, "--output is required, or --guess");
  }
  if (!arguments.topic.empty() && !arguments.guess) {
    return fail(ErrorKind::usage, "--topic belongs to --guess; a map names its columns with their topics");
  }
  if (!arguments.to.empty() && (arguments.guess || !arguments.map.empty())) {
    if (const auto known = check_output(arguments.to, {".h5", ".hdf5"}); !known) {
      return tl::unexpected(known.error());
    }
  }
  if (arguments.guess) {
    return guess_and_import(arguments);
  }
  if (!arguments.map.empty()) {
    return import_by_map(arguments);
  }
  return convert("import", arguments.from, arguments.to, {".h5", ".hdf5"}, read_csv,
                 [](const Recording& recording, const std::filesystem::path& to) { return write_hdf5(recording, to); });
}

bool is_recording(const std::string& file) { return file.ends_with(".h5") || file.ends_with(".hdf5"); }

Expected<int> run_import(const ImportArguments& arguments) {
  const AsRun& run = arguments.run;
  if (!arguments.as_run) {
    const bool of_a_run = run.json || !run.serial.empty() || !run.source.empty() || !run.ins.empty();
    return of_a_run ? fail(ErrorKind::usage, "--serial, --source, --ins and --json belong to --as-run")
                    : convert_to_recording(arguments);
  }
  if (arguments.to.empty() && is_recording(arguments.from)) {
    return import_as_run(arguments.from, arguments.from, run);
  }
  if (arguments.to.empty()) {
    return fail(ErrorKind::usage, "--output is required: the recording that becomes a run");
  }
  const Expected<int> converted = convert_to_recording(arguments);
  return converted && *converted == 0 ? import_as_run(arguments.to, arguments.from, run) : converted;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<ImportArguments>();
  options.text(
      "FILE", arguments->from,
      "with --map or --guess: text with any delimiter, plain or gzip, .npy, .npz, .mat, HDF5, a ROS bag (.db3, "
      ".bag); "
      "else CSV with its attributes in a TOML file of the same stem; with --as-run also a recording (.h5)",
      Needed::yes);
  options.text("-o,--output", arguments->to, "HDF5 file to write: .h5 or .hdf5");
  options.text("--map", arguments->map,
               "TOML file that says which column is what, in which unit; with --guess: where to write it");
  options.flag("--guess", arguments->guess,
               "guess the map from names and numbers, say what is assumed and what is doubted");
  options.text("--topic", arguments->topic, "for --guess: the topic of a ROS bag that has several of sensor_msgs/Imu");
  options.number("--latitude", arguments->known.latitude_deg, range::latitude,
                 "for --guess: latitude of the site, deg");
  options.number("--longitude", arguments->known.longitude_deg, range::angle,
                 "for --guess: longitude of the site, deg");
  options.number("--height", arguments->known.height_m, range::height, "for --guess: height above the ellipsoid, m");
  options.number("--rate", arguments->known.sample_rate_hz, range::sample_rate,
                 "for --guess: sample rate, Hz, of a file without time");
  options.flag(
      "--as-run", arguments->as_run,
      "then hand the recording to the service: it enters the history as a run, estimated and judged; nothing is "
      "written to an INS");
  options.text("--serial", arguments->run.serial,
               "with --as-run: serial number of the INS, where the recording names none");
  options.text("--source", arguments->run.source, "with --as-run: who recorded it, and with what");
  options.text("--ins", arguments->run.ins,
               "with --as-run: the INS of selfcald.toml whose tolerances and limits are meant");
  options.flag("--json", arguments->run.json, "with --as-run: the run's document on standard output");
  return [arguments] { return run_import(*arguments); };
}

const CommandRegistration registration{{"import", "a recording of any form to HDF5", configure}};

}  // namespace
}  // namespace selfcal::cli
