#include "tools/cli/diagnose_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/diagnosis_json.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Adequacy;
using diagnosis::Finding;
using nlohmann::ordered_json;

std::string text_of(const Finding& f) {
  std::string text = fmt::format("  {}  {:.1f} sigma, delta BIC {:.0f}, held-out gain {:.1f}\n    {}\n", f.effect,
                                 f.significance, f.delta_bic, f.held_out_gain, f.equation);
  for (const auto& p : f.parameters) {
    text += fmt::format("    {:12} {:12.5g} +- {:.2g} {}\n", p.name, p.value, p.sigma, p.unit);
  }
  if (!f.equivalent.empty()) {
    text += fmt::format("    cannot be told here from: {}; to split them: {}\n", fmt::join(f.equivalent, ", "),
                        f.experiment);
  }
  return text;
}

std::string places_text(const std::vector<diagnosis::Located>& places, const std::vector<diagnosis::Located>& by) {
  constexpr std::size_t most = 5;
  std::string text;
  const auto add = [&](const diagnosis::Located& l) {
    text += fmt::format("  {:.1f} sigma  {}\n", l.significance, l.words);
  };
  std::for_each(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(std::min(most, places.size())), add);
  std::for_each(by.begin(), by.end(), add);
  return text;
}

}  // namespace

std::string diagnosis_text(const diagnosis::Diagnosis& d) {
  std::string text = fmt::format("verdict: {}\n", verdict_name(d.verdict));
  for (const auto& f : d.faults) {
    text += fmt::format("data fault: {}: {} (first: sample {})\n", f.id, f.words, f.first_sample);
  }
  if (!d.faults.empty()) {
    return text + "nothing else is concluded from faulty data\n";
  }
  text += fmt::format("before: NIS {:.3f}, largest misfit {:.1f} sigma, whiteness log10 p {:.1f}\n", d.before.nis,
                      d.before.largest_sigma, d.before.log_p_white / std::log(10.0));
  text += fmt::format("after:  NIS {:.3f}, largest misfit {:.1f} sigma, whiteness log10 p {:.1f}\n", d.after.nis,
                      d.after.largest_sigma, d.after.log_p_white / std::log(10.0));
  if (!d.located.empty() && !d.before.accepted) {
    text += "where:\n" + places_text(d.located, d.located_by);
  }
  if (!d.findings.empty()) {
    text += "left out:\n";
    for (const Finding& f : d.findings) {
      text += text_of(f);
    }
    double largest = 0.0;
    int at = 0;
    for (int k = 0; k < sensor_parameter_count; ++k) {
      const double moved = std::abs(d.value(k) - d.calibration.value(k)) / d.calibration.sigma(k);
      if (moved > largest) {
        largest = moved;
        at = k;
      }
    }
    const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(at)];
    text += fmt::format("largest error of the 24 by the omission: {} by {:.3g} {} ({:.1f} sigma)\n", p.name,
                        (d.calibration.value(at) - d.value(at)) / p.si_per_unit, p.unit, largest);
  }
  if (d.unexplained) {
    text += "not explained by anything in the catalogue; what remains:\n" + places_text(d.remaining, d.remaining_by);
    for (const Finding& f : d.rejected) {
      text += fmt::format("  the best fitting name, rejected by what remains: {} ({:.1f} sigma)\n", f.effect,
                          f.significance);
    }
  }
  for (const Finding& f : d.suspected) {
    text += fmt::format("too weak to name: {} ({:.1f} sigma corrected); it would show with: {}\n", f.effect,
                        f.significance, f.experiment);
  }
  if (!d.undetectable.empty()) {
    text += "not detectable here at typical size:";
    for (const auto& u : d.undetectable) {
      text += fmt::format(" {} ({:.1f} sigma)", u.effect, u.expected_z);
    }
    text += "\n";
  }
  return text;
}

namespace {

ordered_json to_json(const diagnosis::HeldOutState& s) {
  return {{"log_likelihood", s.log_likelihood},
          {"nis", s.nis},
          {"whiteness_log10_p", s.log_p_white / std::log(10.0)},
          {"parameter_disagreement", s.parameter_disagreement}};
}

}  // namespace

ordered_json comparison_json(const diagnosis::Comparison& c, double false_alarm_rate,
                             const document::InputFile& recording) {
  ordered_json j = diagnosis_json(c.diagnosis, false_alarm_rate);
  j.update(document::head(document::comparison, recording));
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

std::string comparison_text(const diagnosis::Comparison& c) {
  const diagnosis::Diagnosis& d = c.diagnosis;
  std::string text = d.mismatch ? "recording and simulation differ\n" : "recording and simulation agree\n";
  for (const Adequacy* a : {&d.before, &d.after}) {
    text +=
        fmt::format("{} NIS of the difference {:.3f}, largest misfit {:.1f} sigma, whiteness log10 p {:.1f}\n",
                    a == &d.before ? "before:" : "after: ", a->nis, a->largest_sigma, a->log_p_white / std::log(10.0));
  }
  if (!d.before.accepted) {
    text += "where:\n";
    for (std::size_t k = 0; k < std::min<std::size_t>(5, d.located.size()); ++k) {
      text +=
          fmt::format("  {:.1f} sigma  {}: {:.3g} {} more in the recording\n", d.located[k].significance,
                      d.located[k].words, d.located[k].size, d.located[k].axis.starts_with("gyro") ? "deg/h" : "ug");
    }
  }
  if (!c.in_both.empty()) {
    text += "what the simulation holds was taken out of both:";
    for (const Finding& f : c.in_both) {
      text += " " + f.effect;
    }
    text += "\n";
  }
  if (!d.findings.empty()) {
    text += "the recording has more of:\n";
    for (const Finding& f : d.findings) {
      text += text_of(f);
    }
  }
  if (d.unexplained) {
    text += "not explained by anything in the catalogue\n";
  }
  text += "the 24, where they differ by 3 sigma or more:";
  int differing = 0;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    if (std::abs(c.difference(k)) >= 3.0 * c.sigma(k)) {
      const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(k)];
      text += fmt::format("\n  {} by {:.4g} +- {:.2g} {}", p.name, c.difference(k) / p.si_per_unit,
                          c.sigma(k) / p.si_per_unit, p.unit);
      ++differing;
    }
  }
  text += differing == 0 ? " none\n" : "\n";
  constexpr double noticeable = 0.2 * units::degree;
  if (c.attitude_difference > noticeable) {
    text += fmt::format(
        "attitudes differ by up to {:.2f} deg: what both hold and no name was found for cancels only to that degree\n",
        c.attitude_difference / units::degree);
  }
  return text;
}

ordered_json holdout_json(const diagnosis::Holdout& h) {
  return {{"before", to_json(h.before)}, {"after", to_json(h.after)}, {"gain", h.gain}, {"not_carried", h.not_carried}};
}

std::string holdout_text(const diagnosis::Holdout& h) {
  std::string text =
      fmt::format("held-out recording: log likelihood gains {:.1f} with what was named, nothing fitted anew\n", h.gain);
  for (const diagnosis::HeldOutState* s : {&h.before, &h.after}) {
    text += fmt::format(
        "  {} NIS {:.3f}, whiteness log10 p {:.1f}, the 24 against the first recording {:.2f} (1 expected)\n",
        s == &h.before ? "before:" : "after: ", s->nis, s->log_p_white / std::log(10.0), s->parameter_disagreement);
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
    text += fmt::format("  {:8} {:14} {:10.4g} +- {:.2g} {}\n", t.axis, t.function, t.value, t.sigma, t.unit);
  }
  return text;
}

ordered_json splits_json(const std::vector<diagnosis::Split>& splits) {
  ordered_json all = ordered_json::array();
  for (const diagnosis::Split& s : splits) {
    ordered_json j = {
        {"effect", s.effect}, {"rivals", s.rivals}, {"contained_in", s.contain}, {"separation_now", s.separation_now}};
    j["experiments"] = ordered_json::array();
    for (const diagnosis::Experiment& e : s.experiments) {
      j["experiments"].push_back({{"id", e.id},
                                  {"words", e.words},
                                  {"separation", e.separation},
                                  {"closest_rival", e.closest},
                                  {"duration_s", e.schedule.duration_s()}});
    }
    all.push_back(std::move(j));
  }
  return all;
}

std::string splits_text(const std::vector<diagnosis::Split>& splits) {
  std::string text;
  for (const diagnosis::Split& s : splits) {
    text +=
        fmt::format("{} against {}: {:.1f} sigma apart now\n", s.effect, fmt::join(s.rivals, ", "), s.separation_now);
    if (!s.contain.empty()) {
      text += fmt::format(
          "  nothing splits it from {}, of which it is a special case: the fewer parameters are preferred\n",
          fmt::join(s.contain, ", "));
    }
    for (const diagnosis::Experiment& e : s.experiments) {
      text += fmt::format("  {:6.1f} sigma with this recording and one more, {:.0f} min: {} (closest rival {})\n",
                          e.separation, e.schedule.duration_s() / 60.0, e.words, e.closest);
    }
  }
  return text;
}

}  // namespace selfcal::cli
