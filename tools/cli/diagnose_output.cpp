#include "tools/cli/diagnose_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/diagnosis_json.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Finding;
using nlohmann::ordered_json;

ordered_json to_json(const diagnosis::HeldOutState& s) {
  return {{"log_likelihood", s.log_likelihood},
          {"nis", s.nis},
          {"whiteness_log10_p", s.log_p_white / std::log(10.0)},
          {"parameter_disagreement", s.parameter_disagreement}};
}

}  // namespace

ordered_json comparison_json(const diagnosis::Comparison& c, double false_alarm_rate,
                             const document::InputFile& recording) {
  ordered_json of_difference = diagnosis_json(c.diagnosis, false_alarm_rate);
  for (const char* head : {"schema", "program"}) {  // its own comes first, with the input
    of_difference.erase(head);
  }
  ordered_json j = document::with_head(document::comparison, of_difference, recording);
  j["summary"] = summary_json(summary_of_comparison(c));
  for (int k = 0; k < sensor_parameter_count; ++k) {
    const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(k)];
    j["parameters"][static_cast<std::size_t>(k)] = {{"name", p.name},
                                                    {"unit", p.unit},
                                                    {"recording", c.diagnosis.value(k) / p.si_per_unit},
                                                    {"difference", c.difference(k) / p.si_per_unit},
                                                    {"sigma", c.sigma(k) / p.si_per_unit}};
  }
  j["attitude_difference_deg"] = c.attitude_difference / units::degree;
  j["in_both"] = ordered_json::array();
  for (const Finding& f : c.in_both) {
    ordered_json parameters = ordered_json::array();
    for (const auto& p : f.parameters) {
      parameters.push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"sigma", p.sigma}});
    }
    j["in_both"].push_back({{"effect", f.effect}, {"parameters", parameters}});
  }
  return j;
}

ordered_json holdout_json(const diagnosis::Holdout& h) {
  return {{"before", to_json(h.before)}, {"after", to_json(h.after)}, {"gain", h.gain}, {"not_carried", h.not_carried}};
}

std::string holdout_text(const diagnosis::Holdout& h) {
  std::string text =
      fmt::format("held-out recording: log likelihood gains {:.1f} with what was named, nothing fitted anew\n", h.gain);
  for (const diagnosis::HeldOutState* s : {&h.before, &h.after}) {
    text += fmt::format("  {} NIS {}, innovations {}, the 24 against the first recording {} (1 expected)\n",
                        s == &h.before ? "before:" : "after: ", number_text(s->nis), whiteness_text(s->log_p_white),
                        number_text(s->parameter_disagreement));
  }
  if (!h.not_carried.empty()) {
    text += fmt::format("  not carried over: {}\n", fmt::join(h.not_carried, ", "));
  }
  return text;
}

ordered_json empirical_json(const diagnosis::EmpiricalDescription& d) {
  ordered_json j = {{"share_of_misfit", d.share}, {"held_out_gain", d.held_out_gain}};
  j["terms"] = ordered_json::array();
  for (const diagnosis::EmpiricalTerm& t : d.terms) {
    j["terms"].push_back({{"axis", t.axis},
                          {"function", t.function},
                          {"unit", t.unit},
                          {"value", t.value},
                          {"sigma", t.sigma},
                          {"held_out_gain", t.held_out_gain}});
  }
  return j;
}

std::string empirical_text(const diagnosis::EmpiricalDescription& d) {
  if (d.terms.empty()) {
    return "no smooth function of gimbal angles, gravity direction, time or temperature describes what remains\n";
  }
  std::string text = fmt::format(
      "a description, no explanation: smooth functions take away {:.0f} % of the misfit (held-out gain {:.1f})\n",
      100.0 * d.share, d.held_out_gain);
  for (const diagnosis::EmpiricalTerm& t : d.terms) {
    text += fmt::format("  {:8} {:14} {}\n", t.axis, t.function, with_sigma(t.value, t.sigma, t.unit));
  }
  return text;
}

ordered_json splits_json(const std::vector<diagnosis::Split>& splits) {
  ordered_json all = ordered_json::array();
  for (const diagnosis::Split& s : splits) {
    ordered_json j = {{"effect", s.effect->id},
                      {"rivals", ids_of(s.rivals)},
                      {"contained_in", ids_of(s.contain)},
                      {"separation_now", s.separation_now}};
    j["experiments"] = ordered_json::array();
    for (const diagnosis::Experiment& e : s.experiments) {
      j["experiments"].push_back({{"id", e.id},
                                  {"words", e.words},
                                  {"separation", e.separation},
                                  {"closest_rival", e.closest->id},
                                  {"duration_s", e.schedule.duration_s()}});
    }
    all.push_back(std::move(j));
  }
  return all;
}

std::string splits_text(const std::vector<diagnosis::Split>& splits) {
  std::string text;
  for (const diagnosis::Split& s : splits) {
    text += fmt::format("{} against {}: {:.1f} sigma apart now\n", s.effect->id, fmt::join(ids_of(s.rivals), ", "),
                        s.separation_now);
    if (!s.contain.empty()) {
      text += fmt::format(
          "  nothing splits it from {}, of which it is a special case: the fewer parameters are preferred\n",
          fmt::join(ids_of(s.contain), ", "));
    }
    for (const diagnosis::Experiment& e : s.experiments) {
      text += fmt::format("  {:6.1f} sigma with this recording and one more, {:.0f} min: {} (closest rival {})\n",
                          e.separation, e.schedule.duration_s() / 60.0, e.words, e.closest->id);
    }
  }
  return text;
}

}  // namespace selfcal::cli
