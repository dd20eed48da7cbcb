#include "daemon/estimate/result_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "daemon/estimate/left_out.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "daemon/estimate/undetermined_text.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

constexpr std::string_view red = "\033[31m";
constexpr std::string_view green = "\033[32m";
constexpr std::string_view plain = "\033[0m";

std::string coloured(std::string_view text, std::string_view shade, bool colour) {
  return colour ? fmt::format("{}{}{}", shade, text, plain) : std::string(text);
}

// The diagnosis's values are the ones to use.
bool corrected(const JudgedResult& judged) {
  return judged.diagnosis && judged.diagnosis->verdict == diagnosis::DiagnosisVerdict::named;
}

// Empty where a recording that disagrees with the model leaves nothing to say of a single value.
std::string mark_of(const JudgedResult& judged, int k) {
  for (const Objection& objection : judged.gate.objections) {
    if (objection.parameter != k) {
      continue;
    }
    switch (objection.kind) {
      case ObjectionKind::implausible: return "not plausible";
      case ObjectionKind::beyond_limit: return "beyond limit";
      default: return "not determined";
    }
  }
  return judged.gate.usable(k) ? "ok" : "not usable";
}

std::string parameter_row(const JudgedResult& judged, const CalibrationOptions& options, int k, bool colour) {
  const SensorParameter& parameter = sensor_parameters[static_cast<std::size_t>(k)];
  const CalibrationResult& result = judged.result;
  const QuantityText text =
      quantity_text(result.value(k) / parameter.si_per_unit, result.sigma(k) / parameter.si_per_unit);
  std::string row = fmt::format("{:<22}{:>11}{:>9}", parameter.name, text.value, text.sigma);
  if (corrected(judged)) {
    const diagnosis::Diagnosis& d = *judged.diagnosis;
    const QuantityText better = quantity_text(d.value(k) / parameter.si_per_unit, d.sigma(k) / parameter.si_per_unit);
    return row + fmt::format("{:>12}{:>9}  {}\n", better.value, better.sigma, parameter.unit);
  }
  const std::string mark = mark_of(judged, k);
  return row + fmt::format("{:>10}  {:<7} {}\n", number_text(options.tolerance(k) / parameter.si_per_unit),
                           parameter.unit, coloured(mark, mark == "ok" ? green : red, colour));
}

std::string parameters_text(const JudgedResult& judged, const CalibrationOptions& options, bool colour) {
  std::string text =
      corrected(judged)
          ? fmt::format("{:<22}{:>20}{:>21}\n{:<22}{:>11}{:>9}{:>12}{:>9}  {}\n", "", "without the effect", "corrected",
                        "parameter", "value", "sigma", "value", "sigma", "unit")
          : fmt::format("{:<22}{:>11}{:>9}{:>10}  {}\n", "parameter", "value", "sigma", "tolerance", "unit");
  for (int k = 0; k < sensor_parameter_count; ++k) {
    text += parameter_row(judged, options, k, colour);
  }
  return text;
}

std::string passes_text(const CalibrationResult& result) {
  std::string text;
  int number = 0;
  for (const PassSummary& pass : result.passes) {
    text += fmt::format("pass {:<2} {:<8} {:>6.0f} s  NIS {}, largest move {} sigma\n", ++number,
                        pass.direction == PassDirection::forward ? "forward" : "reverse", pass.seconds,
                        number_text(pass.nis_mean), number_text(pass.largest_move_sigma));
  }
  return text;
}

// What the spectra do not show: the walk of position that a coarse quantum makes, and seconds disturbed from outside.
std::string disturbed_text(const CalibrationResult& result) {
  if (!result.noise_of_drift) {
    return {};
  }
  const auto walk = [&](std::size_t axis) { return number_text(walk_density(result.noise.observation.motion[axis])); };
  std::string text =
      fmt::format("position walks by {}, {}, {} m/sqrt(s) (north, up, east): a coarse velocity quantum\n", walk(0),
                  walk(1), walk(2));
  const std::vector<Disturbance>& all = result.noise.disturbed;
  if (!all.empty()) {
    const auto worst = std::max_element(all.begin(), all.end(),
                                        [](const Disturbance& a, const Disturbance& b) { return a.factor < b.factor; });
    text += fmt::format(
        "disturbed from outside in {} intervals of 1 s, which count for less: the worst at {:.0f} s, {} sigma\n",
        all.size(), worst->start_s, number_text(std::sqrt(worst->factor)));
  }
  return text;
}

std::string surroundings_text(const CalibrationResult& result, const Recording& recording) {
  const Attitude& attitude = result.initial_attitude;
  return fmt::format("{}: {} samples, {:.0f} s, answer in {:.1f} s\n",
                     recording.serial.empty() ? "no serial number" : recording.serial, recording.size(),
                     static_cast<double>(recording.size()) / recording.sample_rate_hz, result.elapsed_s) +
         fmt::format("attitude at the start: roll {:.4f}, pitch {:.4f}, heading {:.4f} deg\n",
                     attitude.roll / units::degree, attitude.pitch / units::degree, attitude.heading / units::degree) +
         fmt::format("{} base; noise {}: ARW {} deg/sqrt(h), VRW {} ug/sqrt(Hz), position {} m\n",
                     result.moored ? "moored" : "still", result.noise_given ? "given" : "estimated",
                     number_text(result.gyro_arw / units::degree_per_sqrt_hour),
                     number_text(result.accel_vrw / units::micro_g_per_sqrt_hz), number_text(result.position_sigma)) +
         disturbed_text(result);
}

// Many undetermined parameters are one objection for people: the table marks them, undetermined_text says which.
std::string objections_text(const Gate& gate) {
  if (gate.acceptable()) {
    return {};
  }
  const auto undetermined = [](const Objection& o) { return o.kind == ObjectionKind::undetermined; };
  constexpr std::ptrdiff_t told_singly = 4;
  const std::ptrdiff_t open = std::count_if(gate.objections.begin(), gate.objections.end(), undetermined);
  std::string text = "objections:\n";
  if (open > told_singly) {
    text += fmt::format("  {} parameters not determined\n", open);
  }
  for (const Objection& objection : gate.objections) {
    if (open <= told_singly || !undetermined(objection)) {
      text += fmt::format("  {}\n", objection.words);
    }
  }
  return text;
}

}  // namespace

std::string result_table(const JudgedResult& judged, const CalibrationOptions& options, const Recording& recording,
                         bool colour, int columns) {
  std::string text = summary_text(judged.summary, colour, columns) + "\n";
  if (!judged.result.left_out.empty()) {
    text += left_out_text(judged.result) + "\n";
  }
  text += parameters_text(judged, options, colour) + "\n" + surroundings_text(judged.result, recording) +
          passes_text(judged.result);
  text += undetermined_text(judged.result);
  return text + objections_text(judged.gate);
}

}  // namespace selfcal
