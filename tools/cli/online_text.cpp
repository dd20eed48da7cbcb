#include "tools/cli/online_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/quantity_text.hpp"
#include "protocol/document/summary.hpp"
#include "tools/cli/finding_text.hpp"

namespace selfcal::cli {
namespace {

using json = nlohmann::ordered_json;

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() || !found->is_string() ? std::string() : found->get<std::string>();
}

double number_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() || !found->is_number() ? NAN : found->get<double>();
}

std::string paint(const std::string& text, const char* code, bool colour) {
  return colour ? fmt::format("\033[{}m{}\033[0m", code, text) : text;
}

// A document of an older daemon has no "usable": what was not determined was told by "determined".
std::string mark_of(const json& parameter) {
  if (parameter.contains("usable") && parameter.at("usable") == true) {
    return "ok";
  }
  if (!parameter.at("determined").get<bool>()) {
    return "not determined";
  }
  return parameter.contains("usable") ? "not usable" : "";
}

std::string parameter_lines(const json& result, bool colour) {
  std::string text = fmt::format("{:<24}{:>13}{:>11}  {}\n", "parameter", "value", "sigma", "unit");
  for (const json& parameter : result.at("parameters")) {
    const QuantityText figures = quantity_text(number_of(parameter, "value"), number_of(parameter, "sigma"));
    const std::string mark = mark_of(parameter);
    text += fmt::format("{:<24}{:>13}{:>11}  {:<7} {}\n", text_of(parameter, "name"), figures.value, figures.sigma,
                        text_of(parameter, "unit"), paint(mark, mark == "ok" ? "32" : "33", colour));
  }
  return text;
}

diagnosis::Finding finding_of(const json& document) {
  diagnosis::Finding finding;
  finding.effect = text_of(document, "effect");
  finding.equation = text_of(document, "equation");
  finding.experiment = text_of(document, "experiment");
  finding.significance = number_of(document, "significance");
  for (const json& p : document.at("parameters")) {
    finding.parameters.push_back(
        {text_of(p, "name"), text_of(p, "unit"), number_of(p, "value"), number_of(p, "sigma")});
  }
  for (const json& rival : document.at("equivalent")) {
    finding.equivalent.push_back(rival.get<std::string>());
  }
  return finding;
}

// What a diagnosis in the result names, before the 24 that follow from it.
std::string physics_lines(const json& result, bool amended) {
  const auto diagnosis = result.find("diagnosis");
  if (diagnosis == result.end() || diagnosis->value("findings", json::array()).empty()) {
    return {};
  }
  std::vector<diagnosis::Finding> findings;
  for (const json& document : diagnosis->at("findings")) {
    findings.push_back(finding_of(document));
  }
  std::string text = amended ? "fitted together with the 24:\n" : "left out of the model:\n";
  for (const diagnosis::Finding& finding : findings) {
    text += finding_text(finding);
  }
  return text + symbols_text(findings);
}

// "  bus               can0: up", broken at spaces where a terminal has so many columns.
std::string labelled(const char* label, const std::string& text, int columns) {
  constexpr std::size_t indent = 20;
  constexpr std::size_t narrowest = 16;
  const std::size_t room = columns > 0 ? std::max(narrowest, static_cast<std::size_t>(columns) - indent) : text.size();
  std::string lines = fmt::format("  {:<{}}", label, indent - 2);
  for (std::size_t at = 0; at < text.size() || at == 0;) {
    std::size_t end = std::min(at + room, text.size());
    if (end < text.size()) {
      const std::size_t space = text.rfind(' ', end);
      end = space == std::string::npos || space <= at ? std::min(text.find(' ', end), text.size()) : space;
    }
    lines += fmt::format("{}{}\n", at == 0 ? "" : std::string(indent, ' '), text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

std::string progress_lines(const json& ins, int columns) {
  std::string text = labelled(
      "run",
      fmt::format("{} by {} since {}", ins.at("run").get<std::uint64_t>(), text_of(ins, "user"), text_of(ins, "since")),
      columns);
  std::string far =
      fmt::format("position {} of {}, pages {} of {}", ins.at("position").get<int>(), ins.at("positions").get<int>(),
                  ins.at("pages_pulled").get<int>(), ins.at("pages_expected").get<int>());
  if (number_of(ins, "finish_in_s") >= 0) {
    far += fmt::format(", ends in {:.0f} s", number_of(ins, "finish_in_s"));
  }
  text += labelled("rotation", far, columns);
  const json& estimate = ins.at("estimate");
  if (estimate.is_object()) {
    text += labelled(
        "estimate", fmt::format("{} of 24 parameters to tolerance", estimate.at("tolerances_met").get<int>()), columns);
  }
  return text;
}

std::string memory_lines(const json& ins, int columns) {
  const json& force = ins.at("in_force");
  const json& last = ins.at("last_calibration");
  return labelled("in force",
                  force.is_null() ? std::string("no set that was written from here")
                                  : fmt::format("the set of run {} ({}), since {}", force.at("run").get<int>(),
                                                text_of(force, "kind"), text_of(force, "from_utc")),
                  columns) +
         labelled("last calibration",
                  last.is_null() ? std::string("none")
                                 : fmt::format("run {}, {}, {}", last.at("run").get<int>(), text_of(last, "state"),
                                               text_of(last, "ended_utc")),
                  columns);
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c == '"' ? "\"\"" : std::string(1, c);
  }
  return quoted + "\"";
}

std::string who_and_when(const json& run) {
  const bool ended = !run.at("exit_status").is_null();
  std::string text =
      fmt::format("run {}: {} of INS {} ({}), by {}: {}\n", run.at("run").get<int>(), text_of(run, "kind"),
                  text_of(run, "serial"), text_of(run, "ins"), text_of(run, "user"), text_of(run, "state"));
  text += fmt::format("{} to {}", text_of(run, "started_utc"), ended ? text_of(run, "ended_utc") : "now");
  if (!text_of(run, "schedule").empty()) {
    text += fmt::format(", schedule {}", text_of(run, "schedule"));
  }
  if (run.value("rolls_back", json()).is_number()) {
    text += fmt::format(", rolls back run {}", run.at("rolls_back").get<int>());
  }
  if (run.value("amends", json()).is_number()) {
    text += fmt::format(", of run {}'s recording", run.at("amends").get<int>());
  }
  const bool imported = text_of(run, "kind") == "recording";
  return text + (run.at("dry_run").get<bool>() && !imported ? ", dry run\n" : "\n");
}

std::string facts(const json& run) {
  std::string text;
  if (run.at("early_end_s").is_number()) {
    text += fmt::format("rotation ended early, after {:.0f} s: every tolerance was met\n",
                        run.at("early_end_s").get<double>());
  }
  if (!text_of(run, "source").empty()) {
    text += fmt::format("source: {}; not calibrated over the bus\n", text_of(run, "source"));
  }
  if (!text_of(run, "reason").empty()) {
    text += fmt::format("ended: {}\n", text_of(run, "reason"));
  }
  if (!text_of(run, "force_reason").empty()) {
    text +=
        fmt::format("{}: {}\n", text_of(run, "kind") == "rollback" ? "reason" : "forced", text_of(run, "force_reason"));
  }
  if (!text_of(run, "recording").empty()) {
    text += fmt::format("recording {}\n", text_of(run, "recording"));
  }
  if (run.at("drift_before_m").is_number() && run.at("drift_after_m").is_number()) {
    text += fmt::format("free-inertial drift: {:.1f} m before, {:.1f} m after\n", number_of(run, "drift_before_m"),
                        number_of(run, "drift_after_m"));
  }
  const json& pushed = run.at("coefficients").at("pushed");
  if (pushed.is_object()) {
    text += fmt::format("coefficients version {} written and read back{}\n", pushed.at("version").get<int>(),
                        run.at("coefficients").at("in_force").get<bool>() ? ", in force" : "");
  }
  return text;
}

std::string events(const json& run) {
  std::string text;
  for (const json& event : run.at("events")) {
    text += fmt::format("{}  {:<9} {}\n", text_of(event, "utc"), text_of(event, "kind"), text_of(event, "text"));
  }
  return text.empty() ? text : "\n" + text;
}

// "rollback of run 2: drifts more", "calibration: not written: ...".
std::string history_kind(const json& run) {
  std::string text = text_of(run, "kind");
  if (run.value("rolls_back", json()).is_number()) {
    text += fmt::format(" of run {}", run.at("rolls_back").get<int>());
  }
  if (run.value("amends", json()).is_number()) {
    text += fmt::format(" of run {}", run.at("amends").get<int>());
  }
  if (!text_of(run, "source").empty()) {
    text += fmt::format(" from {}", text_of(run, "source"));
  }
  if (run.contains("in_force") && run.at("in_force").value("now", false)) {
    text += ", in force";
  }
  const std::string why = text_of(run, "reason").empty() ? text_of(run, "force_reason") : text_of(run, "reason");
  return text + (why.empty() ? "" : ": " + why);
}

std::string trend_text(const json& parameter) {
  std::string text = fmt::format("\n{} [{}]", text_of(parameter, "name"), text_of(parameter, "unit"));
  if (parameter.contains("change_per_year")) {
    const double slope = number_of(parameter, "change_per_year");
    text += fmt::format(", {}{} a year", slope > 0.0 ? "+" : "",
                        with_sigma(slope, number_of(parameter, "change_per_year_sigma"), ""));
  }
  text += '\n';
  for (const json& value : parameter.at("values")) {
    const QuantityText figures = quantity_text(number_of(value, "value"), number_of(value, "sigma"));
    text += fmt::format("  {}  run {:<5} {:>12} +- {}{}\n", text_of(value, "utc"), value.at("run").get<int>(),
                        figures.value, figures.sigma, value.at("determined").get<bool>() ? "" : "  not determined");
  }
  for (const json& warning : parameter.at("warnings")) {
    text += fmt::format("  warning: {}\n", warning.get<std::string>());
  }
  return text;
}

}  // namespace

std::string run_ending_text(const std::string& document, bool colour, int columns) {
  const json run = json::parse(document);
  constexpr int most_lines_each = 2;  // three sentences: six lines in all
  return summary_text(read_summary(run.at("summary")), colour, columns, columns > 0 ? most_lines_each : 1);
}

std::string run_text(const std::string& document, bool colour, int columns) {
  const json run = json::parse(document);
  const std::string summary = summary_text(read_summary(run.at("summary")), colour, columns);
  std::string text = summary + "\n" + who_and_when(run) + facts(run);
  if (run.at("result").is_object()) {
    const json& result = run.at("result");
    text += '\n';
    text += physics_lines(result, run.value("amends", json()).is_number());
    text += parameter_lines(result, colour);
  }
  return text + events(run) + (columns > 0 ? "\n" + summary : "");
}

std::string status_text(const std::string& instrument, int columns) {
  const json ins = json::parse(instrument);
  const std::string serial = text_of(ins, "serial");
  std::string text =
      fmt::format("{}{}{}: {}\n", text_of(ins, "ins"), serial.empty() ? "" : " ", serial, text_of(ins, "state"));
  if (text_of(ins, "state") != "idle") {
    text += progress_lines(ins, columns);
  }
  text += labelled("bus", text_of(ins, "bus"), columns);
  return text + (ins.contains("in_force") ? memory_lines(ins, columns) : std::string());
}

std::string history_text(const std::string& document) {
  const json history = json::parse(document);
  std::string text;
  for (const json& run : history.at("runs")) {
    text +=
        fmt::format("run {:<5} {}  {:<10} {:<10} {:<10} {}\n", run.at("run").get<int>(), text_of(run, "started_utc"),
                    text_of(run, "serial"), text_of(run, "state"), text_of(run, "user"), history_kind(run));
  }
  for (const json& parameter : history.at("parameters")) {
    text += parameter.at("values").empty() ? "" : trend_text(parameter);
  }
  return text.empty() ? "no runs\n" : text;
}

std::string history_csv(const std::string& document) {
  const json history = json::parse(document);
  std::string text = "parameter,unit,utc,run,value,sigma,determined\n";
  for (const json& parameter : history.at("parameters")) {
    for (const json& value : parameter.at("values")) {
      text += fmt::format("{},{},{},{},{:.17g},{:.17g},{}\n", csv_field(text_of(parameter, "name")),
                          csv_field(text_of(parameter, "unit")), text_of(value, "utc"), value.at("run").get<int>(),
                          value.at("value").get<double>(), value.at("sigma").get<double>(),
                          value.at("determined").get<bool>());
    }
  }
  return text;
}

}  // namespace selfcal::cli
