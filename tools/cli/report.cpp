// selfcal report: one calibration, or all units, as a self-contained HTML page or an A4 PDF.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/estimate/analysis.hpp"
#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/diagnosis_json.hpp"
#include "daemon/estimate/judged_result.hpp"
#include "daemon/estimate/left_out.hpp"
#include "daemon/host/wall_clock.hpp"
#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/laws_leave.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/file_hash.hpp"
#include "protocol/recording/recording_file.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/diagnose_output.hpp"
#include "tools/cli/estimator_arguments.hpp"
#include "tools/cli/online_client.hpp"
#include "tools/cli/output_file.hpp"
#include "tools/cli/page_writer.hpp"
#ifndef SELFCAL_WITHOUT_HUB
#include "tools/cli/report_hub.hpp"
#endif
#include "tools/cli/sound_part.hpp"
#include "tools/cli/terminal.hpp"
#include "tools/report/calibration_document.hpp"
#include "tools/report/fleet_document.hpp"
#include "tools/report/misfit_map.hpp"
#include "tools/report/overlay_document.hpp"
#include "tools/report/page.hpp"
#include "tools/report/plan_document.hpp"
#include "tools/report/run_document.hpp"
#include "tools/report/run_words.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t largest_document = 50'000'000;  // bytes of a saved document of the daemon

struct ReportArguments {
  std::vector<std::string> subjects;
  std::string output;
  std::string past;
  std::string against;
  std::string hub;
  std::vector<std::string> tolerance;
  NoiseArguments noise;
  bool fleet = false;
  bool no_diagnosis = false;
  double false_alarm_rate = diagnosis::DiagnosisOptions{}.false_alarm_rate;
  report::FleetOptions fleet_options;
};

Expected<CalibrationOptions> options_from(const ReportArguments& arguments) {
  CalibrationOptions options;
  options.noise = arguments.noise.in_si();
  return tolerance_from(arguments.tolerance).map([&](const ParameterVector& tolerance) {
    options.tolerance = tolerance;
    return options;
  });
}

// Adds the diagnosis, and to the summary the cause that it names.
Expected<void> add_diagnosis(Json& page, const JudgedResult& judged, const Recording& recording,
                             const std::string& name, const CalibrationOptions& calibration, double false_alarm_rate,
                             const SoundPart* sound) {
  std::vector<double> first_temperature;
  ImuData data = sound != nullptr ? sound->aside.data() : imu_view(recording, first_temperature);
  diagnosis::DiagnosisOptions options;
  options.calibration = calibration;
  options.false_alarm_rate = false_alarm_rate;
  ProgressLine line;
  const Cause cause = cause_of(data, options, [&line](const std::string& words) { line.show("diagnosis: " + words); });
  if (!cause.diagnosis) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", name, cause.failure));
  }
  const discovery::Discovery* found = cause.beyond ? &*cause.beyond : nullptr;
  Json document = diagnosis_json(*cause.diagnosis, false_alarm_rate, {}, found);
  data.coasts = cause.diagnosis->calibration.coasts;  // with the turns as found
  if (cause.diagnosis->faults.empty()) {
    const bool laws = found != nullptr && found->left.has_value();
    const auto rest = laws ? discovery::less_laws({data, cause.diagnosis->calibration}, found->fit)
                           : diagnosis::CorrectedRecording(data);
    document["map"] = report::misfit_map(data, *cause.diagnosis, laws ? &rest.data() : nullptr);
  }
  page["diagnosis"] = std::move(document);
  page["summary"] = summary_json(summary_of(judged.result, judged.gate, {name, 0}, &*cause.diagnosis, found));
  return {};
}

Expected<Json> recording_document(const std::string& file, const ReportArguments& arguments) {
  const Expected<CalibrationOptions> options = options_from(arguments);
  if (!options) {
    return tl::unexpected(options.error());
  }
  const Expected<LoadedRecording> loaded = read_recording(file, {.gaps_are_errors = false});
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  const Expected<std::unique_ptr<SoundPart>> sound = sound_part(loaded->recording, false);
  if (!sound) {
    return fail(sound.error().kind, fmt::format("{}: {}", file, sound.error().message));
  }
  const diagnosis::SetAside* aside = *sound ? &(*sound)->aside : nullptr;
  const Expected<JudgedResult> judged =
      judged_calibration(loaded->recording, *options, {}, {file, 0}, false, {}, {}, aside);
  if (!judged) {
    return fail(judged.error().kind, fmt::format("{}: {}", file, judged.error().message));
  }
  Json document = report::calibration_document(*judged, *options, loaded->recording, loaded->warnings);
  if (aside != nullptr) {
    document["warnings"].push_back(left_out_text(judged->result));
  }
  if (!arguments.no_diagnosis) {
    const auto added =
        add_diagnosis(document, *judged, loaded->recording, file, *options, arguments.false_alarm_rate, sound->get());
    if (!added) {
      return tl::unexpected(added.error());
    }
  }
  return sha256_of_file(file).map([&](const std::string& hash) {
    document["input"] = {{"name", std::filesystem::path(file).filename().string()}, {"sha256", hash}};
    return std::move(document);
  });
}

// A recording and the calibration that its noise and innovations are of.
struct Calibrated {
  LoadedRecording loaded;
  std::unique_ptr<SoundPart> sound;
  std::vector<double> first_temperature;
  ImuData data;
  CalibrationResult calibration;
};

Expected<std::unique_ptr<Calibrated>> calibrated(const std::string& file, const CalibrationOptions& options) {
  Expected<LoadedRecording> loaded = read_recording(file, {.gaps_are_errors = false});
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  auto all = std::make_unique<Calibrated>();
  all->loaded = std::move(*loaded);
  all->sound = sound_part_or_all(all->loaded.recording);
  all->data = all->sound ? all->sound->aside.data() : imu_view(all->loaded.recording, all->first_temperature);
  CalibrationOutcome outcome = diagnosis::calibrate_still(all->data, options, {});
  if (!outcome.result) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, outcome.failure.message));
  }
  all->calibration = std::move(*outcome.result);
  all->data.coasts = all->calibration.coasts;
  return all;
}

// The recording over the simulation, and what is inside the bands on standard output.
Expected<Json> overlay_page(const std::string& file, const ReportArguments& arguments) {
  const Expected<CalibrationOptions> options = options_from(arguments);
  if (!options) {
    return tl::unexpected(options.error());
  }
  const auto recording = calibrated(file, *options);
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  const auto simulation = calibrated(arguments.against, *options);
  if (!simulation) {
    return tl::unexpected(simulation.error());
  }
  if (std::abs((*recording)->data.sample_rate_hz / (*simulation)->data.sample_rate_hz - 1.0) > 1e-3) {
    return fail(ErrorKind::bad_input, fmt::format("{} has {} Hz, {} has {} Hz", file, (*recording)->data.sample_rate_hz,
                                                  arguments.against, (*simulation)->data.sample_rate_hz));
  }
  const report::Overlay overlay =
      report::lay_over((*recording)->data, (*recording)->calibration, (*simulation)->data, (*simulation)->calibration);
  fmt::print("{}", report::overlay_text(overlay));
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  return sha256_of_file(file).map([&](const std::string& hash) {
    Json document = report::overlay_document(overlay, name(file), name(arguments.against));
    document["input"]["sha256"] = hash;
    return document;
  });
}

// From the daemon, or from a file that holds what it said.
Expected<Json> history_of(const std::string& serial) {
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  return (*manager)->history(serial).and_then(
      [&](const std::string& text) { return report::read_history(text, "history of " + serial); });
}

Expected<Json> saved_history(const std::string& file) {
  return read_text_file(file, largest_document).and_then([&](const std::string& text) {
    return report::read_history(text, file);
  });
}

bool is_number(const std::string& text) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && text.size() < 19 && std::all_of(text.begin(), text.end(), digit);
}

Expected<Json> run_of_daemon(const std::string& number) {
  auto manager = ManagerClient::connect();
  if (!manager) {
    return tl::unexpected(manager.error());
  }
  return (*manager)->show(std::stoull(number)).and_then([&](const std::string& text) {
    return report::read_run(text, "run " + number);
  });
}

// A recording that is gone or may not be read costs the curves, not the page.
Json document_of_run(const Json& run, const ReportArguments& arguments) {
  const std::string recording = run.value("recording", std::string());
  if (recording.empty()) {
    return report::run_page_document(run, std::nullopt);
  }
  Expected<Json> recomputed = recording_document(recording, arguments);
  if (!recomputed) {
    Json document = report::run_page_document(run, std::nullopt);
    document["warnings"].push_back("no curves: " + recomputed.error().message);
    return document;
  }
  return report::run_page_document(run, std::move(*recomputed));
}

// The past from a file, else from the daemon where it gave the run too.
Expected<Json> with_past(Json document, const std::string& serial, const std::string& utc, bool live,
                         const ReportArguments& arguments) {
  if (arguments.past.empty() && (!live || serial.empty())) {
    return document;
  }
  return (arguments.past.empty() ? history_of(serial) : saved_history(arguments.past)).map([&](const Json& history) {
    report::add_history(document, history, utc);
    return std::move(document);
  });
}

Expected<Json> page_of_run(const Json& run, bool live, const ReportArguments& arguments) {
  return with_past(document_of_run(run, arguments), run.at("serial").get<std::string>(),
                   run.at("started_utc").get<std::string>(), live, arguments);
}

Expected<Json> page_of_recording(const std::string& file, const ReportArguments& arguments) {
  Expected<Json> document = recording_document(file, arguments);
  if (!document) {
    return document;
  }
  (*document)["summary"] = report::page_summary(*document);
  const std::string utc = document->value("start_time_utc", std::string());
  return with_past(std::move(*document), {}, utc, false, arguments);
}

// What `show RUN --json`, `investigate --json` or `poses --json` said.
Expected<Json> page_of_document(const std::string& file, const ReportArguments& arguments) {
  const Expected<std::string> text = read_text_file(file, largest_document);
  if (!text) {
    return tl::unexpected(text.error());
  }
  Expected<std::optional<Json>> story = report::read_investigation(*text, file);
  if (!story) {
    return tl::unexpected(story.error());
  }
  if (*story) {
    return std::move(**story);
  }
  Expected<std::optional<Json>> poses = report::read_poses(*text, file);
  if (!poses || *poses) {
    return poses ? Expected<Json>(std::move(**poses)) : tl::unexpected(poses.error());
  }
  return report::read_run(*text, file).and_then([&](const Json& run) { return page_of_run(run, false, arguments); });
}

Expected<Json> page_of(const std::string& subject, const ReportArguments& arguments) {
  if (!arguments.against.empty()) {
    return overlay_page(subject, arguments);
  }
  if (is_number(subject)) {
    return run_of_daemon(subject).and_then([&](const Json& run) { return page_of_run(run, true, arguments); });
  }
  return subject.ends_with(".json") ? page_of_document(subject, arguments) : page_of_recording(subject, arguments);
}

Expected<std::vector<Json>> histories_of_daemon() {
  const Expected<Json> all = history_of("");
  if (!all) {
    return tl::unexpected(all.error());
  }
  std::set<std::string> serials;
  for (const Json& run : all->at("runs")) {
    if (!run.at("serial").get<std::string>().empty()) {
      serials.insert(run.at("serial").get<std::string>());
    }
  }
  std::vector<Json> histories;
  for (const std::string& serial : serials) {
    Expected<Json> history = history_of(serial);
    if (!history) {
      return tl::unexpected(history.error());
    }
    histories.push_back(std::move(*history));
  }
  return histories;
}

Expected<Json> fleet_page(const ReportArguments& arguments) {
#ifndef SELFCAL_WITHOUT_HUB
  if (!arguments.hub.empty()) {
    return fleet_page_of_hub(arguments.hub, arguments.fleet_options);
  }
#endif
  std::vector<Json> histories;
  if (arguments.subjects.empty()) {
    Expected<std::vector<Json>> live = histories_of_daemon();
    if (!live) {
      return tl::unexpected(live.error());
    }
    histories = std::move(*live);
  }
  for (const std::string& file : arguments.subjects) {
    Expected<Json> history = saved_history(file);
    if (!history) {
      return history;
    }
    histories.push_back(std::move(*history));
  }
  return report::fleet_document(histories, arguments.fleet_options);
}

// Which program made the page, and when.
Expected<void> write_page_of_now(Json document, const std::filesystem::path& file) {
  document["program"] = {{"name", "selfcal"}, {"version", SELFCAL_VERSION}};
  document["made_utc"] = utc_now();
  return report::write_page(document, file);
}

Expected<int> page_written(const ReportArguments& arguments) {
  return (arguments.fleet ? fleet_page(arguments) : page_of(arguments.subjects.front(), arguments))
      .and_then([&](const Json& document) { return write_page_of_now(document, arguments.output); })
      .map([] { return 0; });
}

// The page is the answer, whatever it says; `estimate` and `diagnose` have the status that a script asks for.
Expected<int> write_report(ReportArguments arguments) {
  if (const auto known = check_output(arguments.output, {".html", ".pdf"}); !known) {
    return tl::unexpected(known.error());
  }
  if (arguments.fleet) {
    if (arguments.fleet_options.as_of_utc.empty()) {
      arguments.fleet_options.as_of_utc = utc_now();
    }
  } else if (arguments.subjects.size() != 1) {
    return fail(ErrorKind::usage, "one RUN or RECORDING is wanted (or --history for all units)");
  }
  try {
    return page_written(arguments);
  } catch (const Json::exception& error) {  // a value of another type than `show` and `history` write
    std::vector<std::string> files = arguments.subjects;
    if (!arguments.past.empty()) {
      files.push_back(arguments.past);
    }
    return fail(ErrorKind::bad_input,
                fmt::format("{}: not as selfcal writes it: {}", fmt::join(files, ", "), error.what()));
  }
}

Expected<void> write_plan_page(const std::vector<report::PlannedSchedule>& schedules, const Installation& installation,
                               const std::filesystem::path& file) {
  return write_page_of_now(report::plan_document(schedules, installation), file);
}

CommandRun configure(Options& options) {
  plan_page_writer() = write_plan_page;
  auto arguments = std::make_shared<ReportArguments>();
  options.texts(
      "RUN", arguments->subjects,
      "number of a run (asks the daemon), a file with what `show RUN --json` or `investigate --json` said, or a "
      "recording (HDF5, or CSV with its TOML file); with --history: files with what `history SERIAL --json` said, else "
      "all units "
      "of the daemon");
  options.text("-o,--output", arguments->output, "page to write: .html, or .pdf (printed by Chromium)", Needed::yes);
  options.flag("--history", arguments->fleet, "all units: who is due, who drifts, and when it passes its limit");
  options.text("--against", arguments->against,
               "a simulation of the same schedule: spectra, Allan deviation and innovations over each other");
  options.exclude("--against", "--history");
  options.text("--past", arguments->past, "file with what `history SERIAL --json` said, for the unit's past");
#ifndef SELFCAL_WITHOUT_HUB
  options.text("--hub", arguments->hub, "with --history: all units of a depot's hub, by its connection string");
#endif
  options.number("--interval", arguments->fleet_options.interval_days, range::interval,
                 "with --history: days between calibrations");
  options.text("--as-of", arguments->fleet_options.as_of_utc, "with --history: UTC of the page; now if left out");
  options.flag("--no-diagnosis", arguments->no_diagnosis, "leave out the comparison of recording and model");
  options.number("--false-alarm-rate", arguments->false_alarm_rate, range::false_alarm_rate,
                 "of the diagnosis, of a whole recording");
  options.texts("--tolerance", arguments->tolerance, "NAME=VALUE, as for estimate");
  arguments->noise.add_to(options);
  return [arguments] { return write_report(*arguments); };
}

const CommandRegistration registration{
    {"report", "a calibration, an investigation, or all units, as an HTML page with plots", configure}};

}  // namespace
}  // namespace selfcal::cli
