// selfcal poses: diagnosis of sensors turned by hand between static poses: raw counts, no gimbal, no Earth rate.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/convert.hpp"

namespace selfcal::cli {
namespace {

struct PosesArguments {
  std::string file;
  double gyro_unit = 1.0;
  double false_alarm_rate = 0.01;
  bool json = false;
};

// Increments to rates: what `selfcal import` wrote of a sensor without a gimbal.
Expected<diagnosis::PoseInput> read_poses_of_recording(const std::string& path) {
  const Expected<LoadedRecording> loaded = read_hdf5(path, lenient);
  if (!loaded) {
    return tl::unexpected(loaded.error());
  }
  const Recording& recording = loaded->recording;
  diagnosis::PoseInput input;
  input.time_s = recording.time_s;
  const auto rates = [&recording](const std::vector<std::array<double, 3>>& increments) {
    std::vector<std::array<double, 3>> all = increments;
    for (std::array<double, 3>& row : all) {
      for (double& value : row) {
        value *= recording.sample_rate_hz;
      }
    }
    return all;
  };
  input.gyro = rates(recording.delta_theta_rad);
  input.accel = rates(recording.delta_v_mps);
  return input;
}

// One header line, then time, three gyros, three accelerometers; further columns are ignored.
Expected<diagnosis::PoseInput> read_poses(const std::string& path) {
  constexpr std::size_t limit = 256U << 20U;
  const Expected<std::string> text = read_text_file(path, limit);
  if (!text) {
    return tl::unexpected(text.error());
  }
  diagnosis::PoseInput input;
  std::string_view rest = *text;
  std::size_t line_number = 0;
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    std::string_view line = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
    if (++line_number == 1 || line.empty()) {
      continue;
    }
    std::array<double, 7> row{};
    for (std::size_t k = 0; k < row.size(); ++k) {
      const auto [stop, error] = std::from_chars(line.data(), line.data() + line.size(), row[k]);
      if (error != std::errc{} || !std::isfinite(row[k])) {
        return fail(ErrorKind::bad_input, fmt::format("{}: line {}, column {}: {} is no number", path, line_number,
                                                      k + 1, line.substr(0, 20)));
      }
      line.remove_prefix(static_cast<std::size_t>(stop - line.data()));
      line.remove_prefix(line.starts_with(',') ? 1 : 0);
    }
    if (!input.time_s.empty() && row[0] <= input.time_s.back()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: line {}: time {} does not increase", path, line_number, row[0]));
    }
    input.time_s.push_back(row[0]);
    input.gyro.push_back({row[1], row[2], row[3]});
    input.accel.push_back({row[4], row[5], row[6]});
  }
  return input;
}

nlohmann::ordered_json to_json(const std::vector<diagnosis::PoseEffect>& effects) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const diagnosis::PoseEffect& e : effects) {
    nlohmann::ordered_json j = {
        {"effect", e.effect->id}, {"log10_p", e.log_p / std::log(10.0)}, {"held_out_rms", e.held_out_rms}};
    j["parameters"] = nlohmann::ordered_json::array();
    for (std::size_t k = 0; k < e.value.size(); ++k) {
      j["parameters"].push_back({{"name", e.parameters[k]}, {"value", e.value[k]}, {"sigma", e.sigma[k]}});
    }
    all.push_back(std::move(j));
  }
  return all;
}

nlohmann::ordered_json answer_json(const diagnosis::PoseDiagnosis& d) {
  return {{"mismatch", !d.accel_adequate || !d.gyro_named.empty()},
          {"poses", d.poses},
          {"static_s", d.static_seconds},
          {"accelerometers",
           {{"adequate", d.accel_adequate},
            {"rms_g", d.accel_rms_g},
            {"held_out_rms_g", d.accel_held_out_rms_g},
            {"tried", to_json(d.accel_tried)}}},
          {"gyros",
           {{"held_out_rms", d.gyro_held_out_rms},
            {"white_rms", d.gyro_white_rms},
            {"tried", to_json(d.gyro_tried)},
            {"findings", to_json(d.gyro_named)}}},
          {"gravity_direction_deg",
           {{"before", d.direction_before / units::degree},
            {"after", d.direction_after / units::degree},
            {"held_out_before", d.direction_before_held_out / units::degree},
            {"held_out_after", d.direction_after_held_out / units::degree}}},
          {"invisible", d.invisible}};
}

std::string answer_text(const diagnosis::PoseDiagnosis& d) {
  std::string text = fmt::format("{} static poses, {:.0f} s in all\n", d.poses, d.static_seconds);
  text += fmt::format("accelerometers: {}; |f| - g {:.3f} mg rms, held out {:.3f} mg",
                      d.accel_adequate ? "adequate" : "misfit", 1e3 * d.accel_rms_g, 1e3 * d.accel_held_out_rms_g);
  if (!d.accel_tried.empty()) {
    text += fmt::format("; nearest to an effect: {} (log10 p {:.1f})", d.accel_tried.front().effect->id,
                        d.accel_tried.front().log_p / std::log(10.0));
  }
  const auto rms = [](const std::array<double, 3>& v) { return fmt::format("{:.2f}/{:.2f}/{:.2f}", v[0], v[1], v[2]); };
  text += fmt::format("\ngyros in the poses, raw units rms, poses left out in turn: bias alone {} (white noise {})\n",
                      rms(d.gyro_held_out_rms), rms(d.gyro_white_rms));
  for (const diagnosis::PoseEffect& e : d.gyro_tried) {
    text +=
        fmt::format("  with {:28} {}  log10 p {:.1f}\n", e.effect->id, rms(e.held_out_rms), e.log_p / std::log(10.0));
  }
  text += d.gyro_named.empty() ? "nothing named\n" : "named:\n";
  for (const diagnosis::PoseEffect& e : d.gyro_named) {
    text += fmt::format("  {} leaves {}\n", e.effect->id, rms(e.held_out_rms));
    for (std::size_t k = 0; k < e.value.size(); ++k) {
      text += fmt::format("    {:4} {:8.2f} +- {:.2f}\n", e.parameters[k], e.value[k], e.sigma[k]);
    }
  }
  text += fmt::format(
      "direction of gravity carried from pose to pose: {:.2f} deg rms -> {:.2f}; held out {:.2f} -> {:.2f}\n",
      d.direction_before / units::degree, d.direction_after / units::degree,
      d.direction_before_held_out / units::degree, d.direction_after_held_out / units::degree);
  for (const std::string& words : d.invisible) {
    text += fmt::format("invisible: {}\n", words);
  }
  return text;
}

Expected<int> diagnose_by_poses(const PosesArguments& arguments) {
  const bool is_recording = arguments.file.ends_with(".h5") || arguments.file.ends_with(".hdf5");
  Expected<diagnosis::PoseInput> input =
      is_recording ? read_poses_of_recording(arguments.file) : read_poses(arguments.file);
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
    fmt::print("{}\n", document::with_head(document::poses, answer_json(d), *file).dump());
  } else {
    fmt::print("{}", answer_text(d));
  }
  return d.accel_adequate && d.gyro_named.empty() ? 0 : 1;
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
