#include "tools/cli/online_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace selfcal::cli {
namespace {

using nlohmann::json;

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() || !found->is_string() ? std::string() : found->get<std::string>();
}

std::string paint(const std::string& text, const char* code, bool colour) {
  return colour ? fmt::format("\033[{}m{}\033[0m", code, text) : text;
}

std::string parameter_lines(const json& result, bool colour) {
  std::string text = fmt::format("{:<26}{:>14}{:>12}  {}\n", "parameter", "value", "sigma", "unit");
  for (const json& parameter : result.at("parameters")) {
    const bool determined = parameter.at("determined").get<bool>();
    text +=
        fmt::format("{:<26}{:>14.5g}{:>12.3g}  {}{}\n", parameter.at("name").get<std::string>(),
                    parameter.at("value").is_number() ? parameter.at("value").get<double>() : 0.0,
                    parameter.at("sigma").is_number() ? parameter.at("sigma").get<double>() : 0.0,
                    parameter.at("unit").get<std::string>(), determined ? "" : paint("  not determined", "33", colour));
  }
  return text;
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

}  // namespace

std::string run_text(const std::string& document, bool colour, bool story) {
  const json run = json::parse(document);
  const bool ended = !run.at("exit_status").is_null();
  const bool well = ended && run.at("exit_status") == 0;
  std::string text = fmt::format("run {}: {} of INS {} ({}), by {}\n", run.at("run").get<int>(), text_of(run, "kind"),
                                 text_of(run, "serial"), text_of(run, "ins"), text_of(run, "user"));
  text +=
      fmt::format("  {} to {}, schedule {}{}\n", text_of(run, "started_utc"), ended ? text_of(run, "ended_utc") : "now",
                  text_of(run, "schedule"), run.at("dry_run").get<bool>() ? ", dry run" : "");
  if (run.at("early_end_s").is_number()) {
    text += fmt::format("  rotation ended early, after {:.0f} s: every tolerance was met\n",
                        run.at("early_end_s").get<double>());
  }
  text += "  " + paint(text_of(run, "state"), well ? "32" : ended ? "31" : "36", colour);
  if (!text_of(run, "reason").empty()) {
    text += ": " + text_of(run, "reason");
  }
  text += '\n';
  if (!text_of(run, "force_reason").empty()) {
    text += fmt::format("  forced: {}\n", text_of(run, "force_reason"));
  }
  if (!text_of(run, "recording").empty()) {
    text += fmt::format("  recording {}\n", text_of(run, "recording"));
  }
  if (run.at("drift_before_m").is_number() && run.at("drift_after_m").is_number()) {
    text += fmt::format("  free-inertial drift: {:.1f} m before, {:.1f} m after\n",
                        run.at("drift_before_m").get<double>(), run.at("drift_after_m").get<double>());
  }
  const json& pushed = run.at("coefficients").at("pushed");
  if (pushed.is_object()) {
    text += fmt::format("  coefficients version {} written and read back{}\n", pushed.at("version").get<int>(),
                        run.at("coefficients").at("in_force").get<bool>() ? ", in force" : "");
  }
  if (story) {
    for (const json& event : run.at("events")) {
      text += fmt::format("  {}  {:<9} {}\n", text_of(event, "utc"), text_of(event, "kind"), text_of(event, "text"));
    }
  }
  if (run.at("result").is_object()) {
    text += parameter_lines(run.at("result"), colour);
  }
  return text;
}

std::string history_text(const std::string& document) {
  const json history = json::parse(document);
  std::string text;
  for (const json& run : history.at("runs")) {
    text +=
        fmt::format("run {:<5} {}  {:<10} {:<10} {:<10} {}{}\n", run.at("run").get<int>(), text_of(run, "started_utc"),
                    text_of(run, "serial"), text_of(run, "state"), text_of(run, "user"), text_of(run, "kind"),
                    text_of(run, "reason").empty() ? "" : ": " + text_of(run, "reason"));
  }
  for (const json& parameter : history.at("parameters")) {
    if (parameter.at("values").empty()) {
      continue;
    }
    text += fmt::format("\n{} [{}]", text_of(parameter, "name"), text_of(parameter, "unit"));
    if (parameter.contains("change_per_year")) {
      text += fmt::format(", {:+.3g} +- {:.2g} a year", parameter.at("change_per_year").get<double>(),
                          parameter.at("change_per_year_sigma").get<double>());
    }
    text += '\n';
    for (const json& value : parameter.at("values")) {
      text += fmt::format("  {}  run {:<5} {:>12.5g} +- {:.3g}{}\n", text_of(value, "utc"), value.at("run").get<int>(),
                          value.at("value").get<double>(), value.at("sigma").get<double>(),
                          value.at("determined").get<bool>() ? "" : "  not determined");
    }
    for (const json& warning : parameter.at("warnings")) {
      text += fmt::format("  warning: {}\n", warning.get<std::string>());
    }
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
