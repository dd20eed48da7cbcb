// selfcal diagnose: where recording and model differ, which physics was left out, and the proof.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/diagnosis_json.hpp"
#include "daemon/estimate/showing_schedule.hpp"
#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/diagnosis/poses/references.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/recording_file.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "tools/cli/amendment.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/diagnose_output.hpp"
#include "tools/cli/discovery_run.hpp"
#include "tools/cli/dwell_table.hpp"
#include "tools/cli/poses_input.hpp"
#include "tools/cli/poses_output.hpp"
#include "tools/cli/sound_part.hpp"
#include "tools/cli/terminal.hpp"

namespace selfcal::cli {
namespace {

struct DiagnoseArguments {
  std::string recording;
  std::string physics;
  std::string amended;
  std::string against;
  std::string split_schedule;
  std::string holdout;
  DiscoveryArguments discovery;
  bool json = false;
  bool details = false;
  bool strict = false;
  double false_alarm_rate = diagnosis::DiagnosisOptions{}.false_alarm_rate;
  double arw_deg_per_sqrt_h = 0.001, vrw_ug_per_sqrt_hz = 5.0;
  double gyro_lsb_arcsec = 0.1, accel_lsb_mps = 2e-6;
};

constexpr CheckPolicy lenient{
    .gaps_are_errors = false, .gimbal_contradiction_is_error = false, .uneven_force_is_error = false};

// A recording with the estimator's view of it; stays where it is, for the view points into it.
struct Opened {
  document::InputFile file;
  LoadedRecording loaded;
  std::vector<double> first_temperature;
  std::unique_ptr<SoundPart> sound;  // null: all of it
  ImuData data;
};

Expected<std::unique_ptr<Opened>> open(const std::string& path) {
  Expected<LoadedRecording> loaded = read_recording(path, lenient);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  for (const std::string& warning : loaded->warnings) {
    fmt::print(stderr, "selfcal diagnose: warning: {}: {}\n", path, warning);
  }
  Expected<document::InputFile> file = document::identify_file(path);
  if (!file) {
    return tl::unexpected(file.error());
  }
  auto opened = std::make_unique<Opened>();
  opened->file = std::move(*file);
  opened->loaded = std::move(*loaded);
  opened->data = imu_view(opened->loaded.recording, opened->first_temperature);
  return opened;
}

// Diagnoses what is sound of a recording and leaves that in `opened`, with the turns as found.
diagnosis::DiagnosisOutcome diagnose_sound(Opened& opened, const diagnosis::DiagnosisOptions& options, bool strict,
                                           const std::function<void(const std::string&)>& say) {
  if (!strict) {
    opened.sound = sound_part_or_all(opened.loaded.recording);
    opened.data = opened.sound ? opened.sound->aside.data() : opened.data;
  }
  diagnosis::DiagnosisOutcome outcome = diagnosis::diagnose(opened.data, options, say);
  if (outcome.diagnosis && opened.sound) {
    CalibrationResult& calibration = outcome.diagnosis->calibration;
    opened.sound->coasts = calibration.coasts;
    opened.data.coasts = opened.sound->coasts;
    calibration.left_out = opened.sound->aside.left_out();
  }
  return outcome;
}

diagnosis::DiagnosisOptions options_from(const DiagnoseArguments& arguments) {
  diagnosis::DiagnosisOptions options;
  options.false_alarm_rate = arguments.false_alarm_rate;
  options.assumed = {arguments.arw_deg_per_sqrt_h * units::degree_per_sqrt_hour,
                     arguments.vrw_ug_per_sqrt_hz * units::micro_g_per_sqrt_hz,
                     arguments.gyro_lsb_arcsec * units::arcsecond, arguments.accel_lsb_mps};
  return options;
}

Expected<int> compare_with(const DiagnoseArguments& arguments, const Opened& recording,
                           const diagnosis::DiagnosisOptions& options) {
  const Expected<std::unique_ptr<Opened>> simulation = open(arguments.against);
  if (!simulation) {
    return tl::unexpected(simulation.error());
  }
  const diagnosis::ComparisonOutcome outcome = [&] {
    ProgressLine line;
    return diagnosis::compare(recording.data, (*simulation)->data, options,
                              [&line](const std::string& words) { line.show(words); });
  }();
  if (!outcome.comparison) {
    return fail(ErrorKind::bad_input,
                fmt::format("{} against {}: {}", arguments.recording, arguments.against, outcome.failure));
  }
  if (arguments.json) {
    nlohmann::ordered_json json = comparison_json(*outcome.comparison, arguments.false_alarm_rate, recording.file);
    json["against"] = arguments.against;
    json["against_sha256"] = (*simulation)->file.sha256;
    fmt::print("{}\n", json.dump());
  } else {
    fmt::print("{}", comparison_text(*outcome.comparison));
  }
  return outcome.comparison->diagnosis.mismatch ? 1 : 0;
}

Expected<std::optional<diagnosis::Holdout>> held_out(const DiagnoseArguments& arguments,
                                                     const diagnosis::Diagnosis& diagnosis,
                                                     const diagnosis::DiagnosisOptions& options) {
  if (arguments.holdout.empty()) {
    return std::nullopt;
  }
  const Expected<std::unique_ptr<Opened>> second = open(arguments.holdout);
  if (!second) {
    return tl::unexpected(second.error());
  }
  diagnosis::HoldoutOutcome outcome = diagnosis::hold_out(diagnosis, (*second)->data, options);
  if (!outcome.holdout) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", arguments.holdout, outcome.failure));
  }
  return std::move(outcome.holdout);
}

Expected<void> write_files(const DiagnoseArguments& arguments, const diagnosis::Diagnosis& found,
                           const BeyondCatalogue& beyond, const diagnosis::DiagnosisOptions& options,
                           const Opened& opened) {
  diagnosis::Diagnosis diagnosis = found;
  std::string laws;
  if (beyond.explains()) {
    diagnosis.value_as_named = beyond.parameters();
    laws = format_laws(laws_of(*beyond.found));
  }
  Expected<void> written;
  if (!arguments.physics.empty()) {
    written = write_file_atomically(arguments.physics,
                                    physics_text(diagnosis, options.assumed, opened.data.site.latitude) + laws);
  }
  if (diagnosis.unexplained && !beyond.explains() && !(arguments.physics.empty() && arguments.amended.empty())) {
    fmt::print(stderr,
               "selfcal diagnose: warning: nothing explains {}: the 24 values written are BIASED, and a simulation "
               "with them will not agree with the recording\n",
               arguments.recording);
  }
  if (written && !arguments.amended.empty()) {
    written =
        write_amendment(arguments.amended, diagnosis, options.assumed, opened.loaded.recording, opened.data, laws);
  }
  return written;
}

// Where no named effects are to be told apart: what would show the strongest suspect, or, where nothing in the catalogue
// explains the recording, anything at all.
Expected<void> write_showing(const std::string& file, const diagnosis::Diagnosis& diagnosis, const Schedule& done) {
  for (const diagnosis::Finding& suspect : diagnosis.suspected) {
    if (const auto showing = showing_schedule(suspect.experiment, done)) {
      fmt::print(stderr, "selfcal diagnose: {}: {}, to show {}\n", file, showing->words, suspect.effect);
      return write_file_atomically(file, fmt::format("# Would show {}: {}.\n{}", suspect.effect, showing->words,
                                                     format_schedule(showing->schedule)));
    }
  }
  if (diagnosis.unexplained) {
    const ShowingSchedule showing = dwells_between(done);
    fmt::print(stderr, "selfcal diagnose: {}: {}, to see what is not in the catalogue elsewhere\n", file,
               showing.words);
    return write_file_atomically(file, fmt::format("# {}.\n{}", showing.words, format_schedule(showing.schedule)));
  }
  fmt::print(stderr,
             "selfcal diagnose: {} is not written: no effects to tell apart, and none that another schedule would "
             "show\n",
             file);
  return {};
}

// The best experiment of the class that is hardest to split now.
Expected<std::vector<diagnosis::Split>> plan_and_write_splits(const DiagnoseArguments& arguments,
                                                              const diagnosis::Diagnosis& diagnosis,
                                                              const Opened& opened) {
  if (arguments.split_schedule.empty()) {
    return std::vector<diagnosis::Split>{};
  }
  std::vector<diagnosis::Split> splits =
      diagnosis::plan_splits(diagnosis, opened.data, schedule_of(opened.loaded.recording, opened.data));
  const diagnosis::Split* hardest = nullptr;
  for (const diagnosis::Split& s : splits) {
    if (!s.experiments.empty() && (hardest == nullptr || s.separation_now < hardest->separation_now)) {
      hardest = &s;
    }
  }
  if (hardest == nullptr && !splits.empty()) {
    fmt::print(stderr, "selfcal diagnose: {} is not written: nothing splits {} from what it is a special case of\n",
               arguments.split_schedule, splits.front().effect->id);
    return splits;
  }
  if (hardest == nullptr) {
    return write_showing(arguments.split_schedule, diagnosis, schedule_of(opened.loaded.recording, opened.data))
        .map([&] { return splits; });
  }
  const diagnosis::Experiment& best = hardest->experiments.front();
  const std::string text = fmt::format("# Splits {} from {}: {}; {:.1f} sigma predicted.\n{}", hardest->effect->id,
                                       fmt::join(ids_of(hardest->rivals), ", "), best.words, best.separation,
                                       format_schedule(best.schedule));
  return write_file_atomically(arguments.split_schedule, text).map([&] { return splits; });
}

// The further recordings of the unit (--with).
using Others = std::vector<std::unique_ptr<Opened>>;

// The same recording twice would count its noise as a second witness.
Expected<Others> open_others(const DiagnoseArguments& arguments, const Opened& first) {
  Others others;
  std::vector<const document::InputFile*> known = {&first.file};
  for (const std::string& file : arguments.discovery.with) {
    Expected<std::unique_ptr<Opened>> opened = open(file);
    if (!opened) {
      return tl::unexpected(opened.error());
    }
    for (const document::InputFile* before : known) {
      if (before->sha256 == (*opened)->file.sha256) {
        return fail(ErrorKind::bad_input, fmt::format("{}: the same recording as {}", file, before->name));
      }
    }
    others.push_back(std::move(*opened));
    known.push_back(&others.back()->file);
  }
  return others;
}

// Each by itself.
Expected<std::vector<diagnosis::Diagnosis>> diagnose_each(const Others& others,
                                                          const diagnosis::DiagnosisOptions& options, bool strict) {
  std::vector<diagnosis::Diagnosis> diagnoses;
  for (const auto& other : others) {
    const std::string& file = other->file.name;
    ProgressLine line;
    diagnosis::DiagnosisOutcome outcome = diagnose_sound(
        *other, options, strict, [&](const std::string& words) { line.show(fmt::format("{}: {}", file, words)); });
    if (!outcome.diagnosis) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, outcome.failure));
    }
    if (!outcome.diagnosis->faults.empty()) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, outcome.diagnosis->faults.front().words));
    }
    diagnoses.push_back(std::move(*outcome.diagnosis));
  }
  return diagnoses;
}

// There is no physics to try on another recording, to split or to write.
Expected<int> tell_faults(const DiagnoseArguments& arguments, const diagnosis::Diagnosis& diagnosis,
                          const document::InputFile& file) {
  fmt::print("{}", arguments.json ? diagnosis_json(diagnosis, arguments.false_alarm_rate, file).dump() + "\n"
                                  : diagnosis_text(diagnosis, {arguments.recording, 0}, Detail::full,
                                                   use_colour(stdout), text_columns(stdout)));
  for (const std::string* asked :
       {&arguments.holdout, &arguments.split_schedule, &arguments.physics, &arguments.amended}) {
    if (!asked->empty()) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}: nothing to do with {}", arguments.recording,
                                                    diagnosis.faults.front().words, *asked));
    }
  }
  return 1;
}

// A recording whose position says nothing is held against gravity in its poses and against its read-outs.
Expected<int> diagnose_by_poses(const DiagnoseArguments& arguments, const Opened& opened, const std::string& why) {
  for (const std::string* asked :
       {&arguments.holdout, &arguments.split_schedule, &arguments.physics, &arguments.amended, &arguments.against}) {
    if (!asked->empty()) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}: nothing to do with {}", arguments.recording, why, *asked));
    }
  }
  diagnosis::PoseDiagnosis d =
      diagnosis::diagnose_poses(pose_input_of(opened.loaded.recording), 2.0 * arguments.false_alarm_rate);
  if (!d.failure.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}; {}", arguments.recording, why, d.failure));
  }
  d.not_by_position = why;
  if (arguments.json) {
    fmt::print("{}\n", document::with_head(document::poses, poses_json(d), opened.file).dump());
  } else {
    fmt::print("{}more: selfcal poses {} --details\n", poses_summary(d, true), arguments.recording);
  }
  return poses_mismatch(d) ? 1 : 0;
}

// Accelerometers of a cheap sensor are off by some per cent of g, and a logger faster than the sensor writes each sample twice: of a log
// that stands no fault, and no reason to say nothing of it.
bool harmless_at_rest(const diagnosis::Diagnosis& diagnosis, const Recording& recording) {
  Vector3 sum = Vector3::Zero();
  for (const std::array<double, 3>& v : recording.delta_v_mps) {
    sum += Vector3(v[0], v[1], v[2]);
  }
  const double force = sum.norm() * recording.sample_rate_hz / static_cast<double>(recording.delta_v_mps.size());
  constexpr double most = 0.1;
  return !has_read_outs(recording) && std::abs(force / units::standard_gravity - 1.0) < most &&
         std::all_of(diagnosis.faults.begin(), diagnosis.faults.end(), [](const diagnosis::DataFault& fault) {
           return fault.id == "wrong_scale" || fault.id == "lost_samples";
         });
}

Expected<int> diagnose(const DiagnoseArguments& arguments) {
  const Expected<std::unique_ptr<Opened>> opened = open(arguments.recording);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  const ImuData& data = (*opened)->data;
  if (const diagnosis::PositionReference position = diagnosis::position_reference(data); !position.usable) {
    return diagnose_by_poses(arguments, **opened, position.why_not);
  }
  const diagnosis::DiagnosisOptions options = options_from(arguments);
  if (!arguments.against.empty()) {
    return compare_with(arguments, **opened, options);
  }
  const Expected<Others> others = open_others(arguments, **opened);
  if (!others) {
    return tl::unexpected(others.error());
  }
  diagnosis::DiagnosisOutcome outcome = [&] {
    ProgressLine line;
    return diagnose_sound(**opened, options, arguments.strict, [&line](const std::string& words) { line.show(words); });
  }();
  if (!outcome.diagnosis) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", arguments.recording, outcome.failure));
  }
  diagnosis::Diagnosis& diagnosis = *outcome.diagnosis;
  if (!diagnosis.faults.empty() && harmless_at_rest(diagnosis, (*opened)->loaded.recording)) {
    return diagnose_by_poses(arguments, **opened, diagnosis.faults.front().words);
  }
  if (!diagnosis.faults.empty()) {
    return tell_faults(arguments, diagnosis, (*opened)->file);
  }
  if (wanders_at_rest(diagnosis)) {
    return diagnose_by_poses(arguments, **opened, "nothing turned, and its readings change by more than white noise");
  }
  const Expected<std::vector<diagnosis::Diagnosis>> of_others = diagnose_each(*others, options, arguments.strict);
  if (!of_others) {
    return tl::unexpected(of_others.error());
  }
  std::vector<DiagnosedFile> unit = {{(*opened)->file, data, diagnosis}};
  for (std::size_t k = 0; k < others->size(); ++k) {
    unit.push_back({(*others)[k]->file, (*others)[k]->data, (*of_others)[k]});
  }
  Expected<BeyondCatalogue> beyond = look_beyond(arguments.discovery, unit, options, diagnosis);
  if (!beyond) {
    return tl::unexpected(beyond.error());
  }
  const Expected<std::optional<diagnosis::Holdout>> holdout = held_out(arguments, diagnosis, options);
  if (!holdout) {
    return tl::unexpected(holdout.error());
  }
  const Expected<std::vector<diagnosis::Split>> splits = plan_and_write_splits(arguments, diagnosis, **opened);
  if (!splits) {
    return tl::unexpected(splits.error());
  }
  std::optional<diagnosis::EmpiricalDescription> description;
  if (diagnosis.unexplained && !beyond->explains()) {
    description = diagnosis::describe_empirically(data, diagnosis, arguments.false_alarm_rate);
  }
  if (arguments.json) {
    nlohmann::ordered_json json =
        diagnosis_json(diagnosis, arguments.false_alarm_rate, (*opened)->file, beyond->found_or_null());
    if (*holdout) {
      json["holdout"] = holdout_json(**holdout);
    }
    beyond->add_to(json);
    if (description) {
      json["empirical"] = empirical_json(*description);
    }
    if (!arguments.split_schedule.empty()) {
      json["splits"] = splits_json(*splits);
    }
    fmt::print("{}\n", json.dump());
  } else {
    const Detail detail = arguments.details ? Detail::full : Detail::brief;
    fmt::print("{}{}{}{}{}{}{}",
               diagnosis_text(diagnosis, {arguments.recording, 0}, detail, use_colour(stdout), text_columns(stdout),
                              beyond->found_or_null()),
               diagnosis.unexplained && arguments.details ? dwell_table(data, diagnosis) : std::string(),
               beyond->text(detail), description && arguments.details ? empirical_text(*description) : std::string(),
               splits_text(*splits), *holdout ? holdout_text(**holdout) : std::string(),
               arguments.details ? "" : "\nmore: --details\n");
  }
  if (const auto written = write_files(arguments, diagnosis, *beyond, options, **opened); !written) {
    return tl::unexpected(written.error());
  }
  return diagnosis.mismatch ? 1 : 0;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<DiagnoseArguments>();
  options.text("RECORDING", arguments->recording, "HDF5 recording, or CSV with its TOML file", Needed::yes);
  options.flag("--json", arguments->json, "one JSON document on standard output");
  options.flag("--details", arguments->details, "every place, all that was tried, every rival of an equation");
  add_strict_option(options, arguments->strict);
  options.text("--physics", arguments->physics, "write what was named as a physics file for the simulation");
  options.text("--amended", arguments->amended,
               "write physics.toml, sim.toml (with the 24 as fitted) and schedule.toml into this folder");
  options.text("--against", arguments->against,
               "compare with this simulation of the same schedule instead of the fitted model");
  options.text("--split-schedule", arguments->split_schedule,
               "where effects cannot be told apart: plan experiments that would, write the best one's schedule");
  options.text("--holdout", arguments->holdout, "try what was named on this second recording of the same unit");
  options.exclude("--holdout", "--against");
  add_discovery_options(options, arguments->discovery);
  options.number("--false-alarm-rate", arguments->false_alarm_rate, range::false_alarm_rate, "of a whole recording");
  options.number("--arw", arguments->arw_deg_per_sqrt_h, range::arw,
                 "angle random walk the simulation assumes, deg/sqrt(h)");
  options.number("--vrw", arguments->vrw_ug_per_sqrt_hz, range::vrw, "velocity random walk it assumes, ug/sqrt(Hz)");
  options.number("--gyro-lsb", arguments->gyro_lsb_arcsec, range::gyro_quantum,
                 "quantum of the gyros it assumes, arcsec");
  options.number("--accel-lsb", arguments->accel_lsb_mps, range::accel_quantum,
                 "quantum of the accelerometers it assumes, m/s");
  return [arguments] { return diagnose(*arguments); };
}

const CommandRegistration registration{{"diagnose", "which physics a recording holds beyond the model", configure}};

}  // namespace
}  // namespace selfcal::cli
