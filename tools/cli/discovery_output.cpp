#include "tools/cli/discovery_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::cli {
namespace {

using discovery::ClassMember;
using discovery::Constant;
using discovery::DiscoveredLaw;
using discovery::Discovery;
using nlohmann::ordered_json;

constexpr std::size_t members_shown = 6;

// Two digits of sigma, and the value to the same place.
std::string with_sigma(double value, double sigma, std::string_view unit) {
  const int decimals = sigma > 0.0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 12) : 6;
  return fmt::format("{:.{}f} +- {:.{}f} {}", value, decimals, sigma, decimals, unit);
}

std::string constants_text(const std::vector<Constant>& constants) {
  std::string text;
  for (const Constant& c : constants) {
    text += fmt::format("    {} = {}\n", c.name, with_sigma(c.value, c.sigma, c.unit));
  }
  return text;
}

// Other words for one function, which no rotation tells apart: anywhere, or as long as the base stands as it does.
std::string also_text(const ClassMember& m, const char* indent) {
  constexpr std::size_t most = 3;
  std::string text;
  for (const bool here : {false, true}) {
    std::vector<std::string> some;
    for (const discovery::OtherWords& other : m.also) {
      if (other.only_here == here) {
        some.push_back(some.size() < most ? other.expression : "...");
      }
    }
    some.resize(std::min(some.size(), most + 1));
    if (!some.empty()) {
      text += fmt::format("{}the same as {}{}\n", indent, fmt::join(some, ", "),
                          here ? ", as long as the base stands as it does" : "");
    }
  }
  return text;
}

bool is_itself(const ClassMember& m, const DiscoveredLaw& law) {
  return m.expression == law.expression && m.axis == law.term.axis;
}

std::string class_text(const DiscoveredLaw& law) {
  std::string text;
  for (const ClassMember& m : law.ambiguous) {
    text += is_itself(m, law) ? also_text(m, "    ") : std::string();
  }
  if (law.ambiguous.size() < 2) {
    return text + "    no other equation that was tried explains this recording as well\n";
  }
  text +=
      fmt::format("    {} others explain this recording too (odds against the one above):\n", law.ambiguous.size() - 1);
  std::size_t shown = 0;
  for (const ClassMember& m : law.ambiguous) {
    if (is_itself(m, law)) {
      continue;
    }
    if (shown++ == members_shown) {
      return text + "      ...\n";
    }
    text += fmt::format("      {:<8} {}  ({:.2g})\n", name_of_axis(m.axis), m.expression, m.odds) +
            also_text(m, "               ");
  }
  return text;
}

// The most probable ones in a line.
std::string rivals_text(const DiscoveredLaw& law) {
  constexpr std::size_t most = 2;
  std::vector<const ClassMember*> rivals;
  for (const ClassMember& m : law.ambiguous) {
    if (!is_itself(m, law)) {
      rivals.push_back(&m);
    }
  }
  if (rivals.empty()) {
    return {};
  }
  std::stable_sort(rivals.begin(), rivals.end(), [](const auto* a, const auto* b) { return a->odds > b->odds; });
  std::vector<std::string> words;
  for (const ClassMember* m : std::span(rivals).first(std::min(most, rivals.size()))) {
    const std::string axis = m->axis == law.term.axis ? "" : std::string(name_of_axis(m->axis)) + " ";
    words.push_back(fmt::format("{}{} (odds {:.2g})", axis, m->expression, m->odds));
  }
  const std::size_t more = rivals.size() - words.size();
  return fmt::format("    explains this recording too: {}{}\n", fmt::join(words, ", "),
                     more > 0 ? fmt::format(", and {} more", more) : std::string());
}

// Its equation, how sure, and its share.
std::string law_head(const DiscoveredLaw& law) {
  return fmt::format("  {} = ({}) * {}\n    {:.1f} sigma, {:.0f} % of the misfit", name_of_axis(law.term.axis),
                     with_sigma(law.coefficient, law.sigma, unit_of_axis(law.term.axis)), law.expression,
                     law.significance, 100.0 * law.share);
}

std::string brief_law_text(const DiscoveredLaw& law) {
  return law_head(law) + fmt::format("; holds on another plan with a probability of {:.2f}\n", law.carries_over) +
         constants_text(law.constants) + rivals_text(law);
}

std::string law_text(const DiscoveredLaw& law, Detail detail) {
  if (detail == Detail::brief) {
    return brief_law_text(law);
  }
  std::string text = law_head(law) + fmt::format(", held-out gain {:.0f}\n", law.held_out_gain);
  text += law.effect.empty() ? std::string()
                             : fmt::format("    as the catalogue's {}, which alone leaves too much\n", law.effect);
  text += constants_text(law.constants) + class_text(law);
  return text + fmt::format(
                    "    on another plan it leaves at most a tenth with a probability of {:.2f};\n"
                    "    among the best in {:.0f} % of draws of three quarters of the recording\n",
                    law.carries_over, 100.0 * law.stability);
}

// An axis whose form is none of what was tried.
std::string described_text(const Discovery& found, Detail detail) {
  if (found.described.empty()) {
    return {};
  }
  const bool unsure = found.described.front().unsure;
  std::string text =
      unsure
          ? fmt::format(
                "  no equation holds on another plan more probably than not ({:.2f} the best of {}); a description of\n"
                "  this recording, not to be used on another:\n",
                found.described.front().carries_over, found.described.front().ambiguous.size())
          : "  a description of this recording, not to be used on another:\n";
  for (const DiscoveredLaw& law : found.described) {
    text += fmt::format("    {:<8} ({}) * {}, {:.0f} % of the misfit\n", name_of_axis(law.term.axis),
                        with_sigma(law.coefficient, law.sigma, unit_of_axis(law.term.axis)), law.expression,
                        100.0 * law.share);
    text += law.unsure ? std::string() : fmt::format("      no equation, for {}\n", law.why);
    text += !law.unsure ? std::string() : detail == Detail::brief ? rivals_text(law) : class_text(law);
  }
  return text;
}

std::string left_text(const Discovery& found) {
  const double noise = std::sqrt(2.0 * found.rows);
  if (found.misfit_after < 3.0 * noise) {
    return "  what is left is noise\n";
  }
  return fmt::format("  {:.0f} % of the misfit is left without an equation{}\n",
                     100.0 * found.misfit_after / std::max(found.misfit_before, 1.0),
                     found.refused.empty()
                         ? ""
                         : "; the best that was refused, for it does not predict what was left out: " + found.refused);
}

ordered_json constants_json(const std::vector<Constant>& constants) {
  ordered_json all = ordered_json::object();
  for (const Constant& c : constants) {
    all[c.name] = {{"value", c.value}, {"sigma", c.sigma}, {"unit", c.unit}};
  }
  return all;
}

std::string_view words_of(diagnosis::DiagnosisVerdict verdict) {
  using V = diagnosis::DiagnosisVerdict;
  switch (verdict) {
    case V::adequate: return "recording and model agree";
    case V::named: return "named";
    case V::none_of_the_above: return "none of the above";
    case V::not_enough_information: return "not enough information";
    case V::data_fault: return "a fault of the data";
  }
  return "";
}

// "p = 0.31", "p = 1e-19"
std::string p_text(double log_p) {
  const double exponent = log_p / std::log(10.0);
  return exponent > -3.0 ? fmt::format("p = {:.2g}", std::exp(log_p)) : fmt::format("p = 1e{:.0f}", exponent);
}

std::string shared_text(const char* what, bool shared, double log_p) {
  return fmt::format("  {}: {} ({})\n", what, shared ? "the same in all of them" : "not the same in all of them",
                     p_text(log_p));
}

// One line a coefficient; common ones once, the others for each recording.
std::string fitted_text(const discovery::FittedEffect& effect) {
  const diagnosis::Effect& e = *effect.effect;
  const bool several = effect.each.size() > 1;
  std::string text =
      fmt::format("  {}{}\n", e.id,
                  !several ? ""
                  : effect.all_common()
                      ? fmt::format(": the same in all recordings that can hold it ({})", p_text(effect.log_p_common))
                      : fmt::format(": not the same in all recordings ({})", p_text(effect.log_p_common)));
  if (effect.nothing_left()) {
    return text +
           fmt::format("    nothing is left of it when all is fitted together ({})\n", p_text(effect.log_p_none));
  }
  for (std::size_t k = 0; k < effect.common.size(); ++k) {
    const bool common = effect.common[k];
    for (const discovery::EffectFit& fit : effect.each) {
      const auto at = static_cast<Eigen::Index>(k);
      const bool constant = k == e.parameters.size();
      const diagnosis::EffectParameter& p = e.parameters[constant ? 0 : k];
      text += fmt::format("    {}{}: {}\n", name_of_coefficient(e, static_cast<int>(k)),
                          common ? "" : fmt::format(", recording {}", fit.recording + 1),
                          constant ? with_sigma(fit.constant, fit.constant_sigma, e.constant.unit)
                                   : with_sigma(fit.size(at) * p.typical, fit.sigma(at) * p.typical, p.unit));
      if (common) {
        break;
      }
    }
  }
  return text;
}

}  // namespace

std::string together_text(const Together& together) {
  std::string text = fmt::format("{} recordings of one unit together\n", together.recordings.size());
  for (std::size_t k = 0; k < together.recordings.size(); ++k) {
    const Together::Recording& r = together.recordings[k];
    text += fmt::format("  {}. {}: by itself {}{}\n", k + 1, r.file.name, words_of(r.verdict),
                        r.names.empty() ? "" : fmt::format(": {}", fmt::join(r.names, ", ")));
  }
  if (!together.taken_out.empty()) {
    text += fmt::format("  taken out of them first: {}\n", fmt::join(together.taken_out, ", "));
  }
  const discovery::SharedParameters& shared = together.shared;
  text += shared_text("scale factors and misalignments", shared.lasting_shared, shared.log_p_lasting);
  text += shared_text("accelerometer biases and gyro drifts", shared.biases_shared, shared.log_p_biases);
  std::size_t shown = 0;
  for (const discovery::UnsharedParameter& d : shared.differing) {
    if (shown++ == members_shown) {
      text += fmt::format("    and {} more\n", shared.differing.size() - members_shown);
      break;
    }
    const SensorParameter& parameter = sensor_parameters.at(static_cast<std::size_t>(d.parameter));
    text +=
        fmt::format("    {}: {} more in recording {}\n", parameter.name,
                    with_sigma(d.difference / parameter.si_per_unit, d.sigma / parameter.si_per_unit, parameter.unit),
                    d.recording + 1);
  }
  return text;
}

std::string effects_text(const discovery::JointFit& joint) {
  std::string text;
  for (const discovery::FittedEffect& effect : joint.effects) {
    text += fitted_text(effect);
  }
  for (const discovery::Entangled& e : joint.entangled) {
    const diagnosis::Effect& effect = *joint.effects[e.effect].effect;
    text += fmt::format("  {} {} and {} = {} share their evidence (correlation {:.2f}); the sigma of each holds it\n",
                        effect.id, name_of_coefficient(effect, e.coefficient), name_of_axis(e.axis), e.expression,
                        e.correlation);
  }
  return text.empty() ? text : "named effects, fitted together with the laws and the 24 of each recording\n" + text;
}

namespace {

std::string next_text(const std::optional<discovery::NextExperiment>& next) {
  if (!next) {
    return {};
  }
  return fmt::format(
      "  next experiment: {:.0f} min, {} positions: its rival {} would be {:.1f} sigma away ({:.1f} now)\n",
      next->schedule.duration_s() / 60.0, next->schedule.positions.size(), next->closest, next->separation,
      next->separation_now);
}

}  // namespace

std::string discovery_text(const Discovery& found, const std::optional<discovery::NextExperiment>& next,
                           Detail detail) {
  if (found.laws.empty() && found.processes.empty()) {
    return fmt::format("\ndiscovery: no equation among {} explains what remains\n", found.functions_tried) +
           described_text(found, detail) + left_text(found) + next_text(next);
  }
  std::string text =
      fmt::format("\ndiscovery: found among {} equations; each predicts the dwells and rotations left out of its fit\n",
                  found.functions_tried);
  for (const DiscoveredLaw& law : found.laws) {
    text += law_text(law, detail);
  }
  for (const discovery::DiscoveredProcess& p : found.processes) {
    const bool walk = p.kind == discovery::ProcessKind::random_walk;
    text += fmt::format("  {}: a random process, {}: {}{}\n", name_of_axis(p.axis), discovery::name_of(p.kind),
                        with_sigma(p.size, p.sigma, unit_of_axis(p.axis)), walk ? "/sqrt(h)" : " (standard deviation)");
  }
  if (found.instead) {
    text += "  or " + instead_words(*found.instead) + "\n";
  }
  return text + described_text(found, detail) + left_text(found) + next_text(next);
}

std::string trial_text(const std::vector<discovery::TriedLaw>& tried) {
  std::string text = "laws tried beside the 24 and what is named:\n";
  for (const discovery::TriedLaw& law : tried) {
    const bool predicts = law.held_out_gain > 0.0;
    text += fmt::format(
        "  {} = ({}) * {}\n    {:.1f} sigma, {:.0f} % of the misfit; {} (held-out gain {:.1f})\n",
        name_of_axis(law.term.axis), with_sigma(law.coefficient, law.sigma, unit_of_axis(law.term.axis)),
        law.expression, law.significance, 100.0 * law.share,
        predicts ? "it predicts what was left out of its fit" : "it does not predict what was left out of its fit",
        law.held_out_gain);
    text += constants_text(law.constants);
    if (std::isfinite(law.stated)) {
      text += fmt::format("    stated: {:.6g} {}, {:.1f} sigma from what this recording says\n", law.stated,
                          unit_of_axis(law.term.axis), std::abs(law.stated - law.coefficient) / law.sigma);
    }
    if (!law.shares_with.empty()) {
      text += fmt::format("    shares its evidence with {}: its sigma holds what they leave open\n",
                          fmt::join(law.shares_with, ", "));
    }
    if (!law.seen()) {
      text +=
          "    these recordings cannot show it: a bias, a scale factor or a misalignment does the same, or it hardly "
          "acts\n";
    }
    if (law.collinear > 0.99) {
      text += "    nearly collinear with the other laws or with its own constants: its sigma says how little is seen\n";
    }
  }
  return text;
}

ordered_json trial_json(const std::vector<discovery::TriedLaw>& tried) {
  ordered_json all = ordered_json::array();
  for (const discovery::TriedLaw& law : tried) {
    ordered_json j = {{"axis", name_of_axis(law.term.axis)},
                      {"expression", law.expression},
                      {"coefficient", law.coefficient},
                      {"sigma", law.sigma},
                      {"unit", unit_of_axis(law.term.axis)},
                      {"constants", constants_json(law.constants)},
                      {"significance", law.significance},
                      {"held_out_gain", law.held_out_gain},
                      {"share", law.share},
                      {"collinear", law.collinear},
                      {"shares_with", law.shares_with},
                      {"seen", law.seen()}};
    if (std::isfinite(law.stated)) {
      j["stated"] = law.stated;
    }
    all.push_back(std::move(j));
  }
  return all;
}

std::vector<LawText> laws_of(const Discovery& found) {
  std::vector<LawText> laws;
  for (const DiscoveredLaw& law : found.laws) {
    laws.push_back({law.term.axis, law.expression, "", law.coefficient, law.sigma, std::nullopt});
  }
  for (const discovery::DiscoveredProcess& p : found.processes) {
    laws.push_back({p.axis, "", std::string(discovery::name_of(p.kind)), p.size, p.sigma, std::nullopt});
  }
  return laws;
}

}  // namespace selfcal::cli
