#include "daemon/estimate/beyond_catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/estimate/quantity_text.hpp"
#include "estimator/discovery/explanation_cost.hpp"
#include "estimator/discovery/named_effects.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal {
namespace {

using discovery::DiscoveredLaw;
using discovery::DiscoveredProcess;
using discovery::Discovery;
using discovery::ProcessKind;
using nlohmann::ordered_json;

constexpr std::size_t most_told = 3;  // equations in a sentence
constexpr const char* takes_offsets = "takes a new offset at each turn";
constexpr double worth_a_word = 0.1;  // odds of another explanation, in a verdict
constexpr double sure = 0.9;          // that an equation holds on another plan; below it the verdict counts its rivals

// By laws and processes that are told.
double misfit_left(const Discovery& found) {
  return found.described.empty() ? found.misfit_after : (1.0 - explained_share(found)) * found.misfit_before;
}

bool leaves_noise(const Discovery& found) { return found.misfit_after < 3.0 * std::sqrt(2.0 * found.rows); }

std::string process_unit(const DiscoveredProcess& p) {
  return fmt::format("{}{}", unit_of_axis(p.axis), p.kind == ProcessKind::random_walk ? "/sqrt(h)" : "");
}

// "accel_y and accel_z take a new offset at each turn"
std::string processes_words(const std::vector<DiscoveredProcess>& processes, ProcessKind kind, const char* one,
                            const char* several) {
  std::vector<std::string_view> axes;
  for (const DiscoveredProcess& p : processes) {
    if (p.kind == kind) {
      axes.push_back(name_of_axis(p.axis));
    }
  }
  if (axes.empty()) {
    return {};
  }
  const std::string_view last = axes.back();
  axes.pop_back();
  return axes.empty() ? fmt::format("{} {}", last, one)
                      : fmt::format("{} and {} {}", fmt::join(axes, ", "), last, several);
}

std::vector<std::string> words_of(const std::vector<DiscoveredProcess>& processes) {
  std::vector<std::string> all = {
      processes_words(processes, ProcessKind::jump_per_turn, takes_offsets, "take a new offset at each turn"),
      processes_words(processes, ProcessKind::random_walk, "has a bias that walks at random",
                      "have biases that walk at random")};
  std::erase_if(all, [](const std::string& words) { return words.empty(); });
  return all;
}

// The first few of them, and how many more there are.
std::string first_of(std::vector<std::string> all, std::string_view between, std::string_view before_more) {
  const std::size_t more = all.size() > most_told ? all.size() - most_told : 0;
  all.resize(all.size() - more);
  return fmt::format("{}{}", fmt::join(all, between),
                     more > 0 ? fmt::format("{}and {} more", before_more, more) : std::string());
}

// Of what explains the recordings as well, what differs on another plan or another base.
std::size_t others_elsewhere(const DiscoveredLaw& law) {
  std::size_t others = law.ambiguous.size() - std::min<std::size_t>(1, law.ambiguous.size());
  for (const discovery::ClassMember& m : law.ambiguous) {
    others += static_cast<std::size_t>(
        std::count_if(m.also.begin(), m.also.end(), [](const discovery::OtherWords& w) { return w.only_here; }));
  }
  return others;
}

ordered_json law_json(const DiscoveredLaw& law) {
  ordered_json constants = ordered_json::object();
  for (const discovery::Constant& c : law.constants) {
    constants[c.name] = {{"value", c.value}, {"sigma", c.sigma}, {"unit", c.unit}};
  }
  ordered_json members = ordered_json::array();
  for (const discovery::ClassMember& m : law.ambiguous) {
    ordered_json also = ordered_json::array(), only_here = ordered_json::array();
    for (const discovery::OtherWords& other : m.also) {
      also.push_back(other.expression);
      if (other.only_here) {
        only_here.push_back(other.expression);
      }
    }
    members.push_back({{"expression", m.expression},
                       {"axis", name_of_axis(m.axis)},
                       {"odds", m.odds},
                       {"also", also},
                       {"only_here", only_here}});
  }
  ordered_json document = {{"axis", name_of_axis(law.term.axis)},
                           {"expression", law.expression},
                           {"coefficient", law.coefficient},
                           {"sigma", law.sigma},
                           {"unit", unit_of_axis(law.term.axis)},
                           {"constants", constants},
                           {"significance", law.significance},
                           {"held_out_gain", law.held_out_gain},
                           {"share", law.share}};
  if (!law.effect.empty()) {
    document["effect"] = law.effect;
  }
  if (!law.why.empty()) {
    document["why"] = law.why;
  }
  if (law.unsure) {
    document["unsure"] = true;
  }
  // Else its class was not looked at, or holds none that is the law.
  if (law.carries_over > 0.0 && (law.why.empty() || law.unsure)) {
    document["stability"] = law.stability;
    document["carries_over"] = law.carries_over;
  }
  document["class"] = members;
  return document;
}

}  // namespace

double explained_share(const Discovery& found) {
  if (found.laws.empty() && found.processes.empty()) {
    return 0.0;
  }
  if (!found.described.empty()) {  // what is left after them too is not what these laws leave
    double gain = 0.0;
    for (const DiscoveredLaw& law : found.laws) {
      gain += law.gain;
    }
    return std::clamp(gain / std::max(1.0, found.misfit_before), 0.0, 1.0);
  }
  return std::clamp(1.0 - found.misfit_after / std::max(1.0, found.misfit_before), 0.0, 1.0);
}

bool explains(const Discovery* found) {
  constexpr double most = 0.9;
  if (found == nullptr || (found->laws.empty() && found->processes.empty())) {
    return false;
  }
  const bool whole = found->described.empty();
  return (whole && leaves_noise(*found)) || ((whole || found->processes.empty()) && explained_share(*found) >= most);
}

bool confirmed(const Discovery* found) {
  return found != nullptr && found->fit.recordings.size() > 1 && !found->laws.empty() && found->described.empty() &&
         found->processes.empty() && leaves_noise(*found);
}

namespace {

// Both walk and jump are fitted in the search; an instability is not, and is left alone.
bool jumps_in_place_of_walks(const Discovery& found, const diagnosis::Diagnosis& d) {
  double ahead = 0.0;
  for (const DiscoveredProcess& p : found.processes) {
    ahead += p.kind == discovery::ProcessKind::jump_per_turn ? p.ahead : -p.ahead;
  }
  const auto jumps = [&found](bool gyro) {
    return std::any_of(found.processes.begin(), found.processes.end(),
                       [gyro](const DiscoveredProcess& p) { return (p.axis < 3) == gyro; });
  };
  const auto walks = [&d](const char* name) {
    return std::any_of(d.findings.begin(), d.findings.end(),
                       [name](const diagnosis::Finding& f) { return f.effect == name; });
  };
  const bool others = std::any_of(d.findings.begin(), d.findings.end(), [](const diagnosis::Finding& f) {
    return f.process && f.effect != "gyro_random_walk" && f.effect != "accel_random_walk";
  });
  return !others && ahead >= std::log(discovery::far_likelier) && jumps(true) == walks("gyro_random_walk") &&
         jumps(false) == walks("accel_random_walk");
}

}  // namespace

bool replaces_process(const Discovery& found, const diagnosis::Diagnosis& d) {
  const bool alone = found.laws.empty() != found.processes.empty();  // equations, or processes
  return discovery::names_process(d) && alone && found.described.empty() && explains(&found) &&
         (found.processes.empty() || jumps_in_place_of_walks(found, d));
}

void replace_process(diagnosis::Diagnosis& d, const Discovery& found) {
  if (!replaces_process(found, d)) {
    return;
  }
  const auto kept = std::stable_partition(d.findings.begin(), d.findings.end(),
                                          [](const diagnosis::Finding& f) { return !f.process; });
  d.rejected.insert(d.rejected.end(), kept, d.findings.end());
  d.findings.erase(kept, d.findings.end());
  d.unexplained = d.mismatch = true;
  const bool equations = std::any_of(d.findings.begin(), d.findings.end(),
                                     [](const diagnosis::Finding& f) { return f.source != nullptr; });
  d.verdict = equations ? diagnosis::DiagnosisVerdict::named : diagnosis::DiagnosisVerdict::none_of_the_above;
}

diagnosis::Diagnosis with_laws(diagnosis::Diagnosis diagnosis, const Discovery* found) {
  if (diagnosis.unexplained && found != nullptr && !found->average.parameters.empty()) {
    const ParameterVector& value = found->average.parameters.front();
    const ParameterMatrix& covariance = found->average.covariance.front();
    if (explains(found)) {
      diagnosis.value = diagnosis.value_as_named = value;
      diagnosis.covariance = covariance;
      diagnosis.covariance += diagnosis.open_beside_named;
    } else {  // neither is right: sigma holds both
      const ParameterVector moved = value - diagnosis.value;
      diagnosis.covariance += covariance + moved * moved.transpose();
    }
    diagnosis.sigma = diagnosis.covariance.diagonal().cwiseSqrt();
  }
  if (diagnosis.unexplained && explains(found) && found->left) {
    diagnosis.after = found->left->adequacy;
    diagnosis.remaining = found->left->places;
    diagnosis.remaining_by = found->left->by_quantity;
  }
  return diagnosis;
}

std::string left_words(const Discovery& found) {
  if (found.described.empty() && leaves_noise(found)) {
    return {};
  }
  const double percent = 100.0 * (1.0 - explained_share(found));
  return fmt::format("; {} of the misfit is left",
                     percent < 1.0 ? std::string("less than 1 %") : fmt::format("{:.0f} %", percent));
}

std::string discovered_words(const Discovery& found) {
  std::vector<std::string> all;
  for (const DiscoveredLaw& law : found.laws) {
    const std::size_t others = law.carries_over < sure ? others_elsewhere(law) : 0;
    all.push_back(fmt::format("{} follows {}{}{}", name_of_axis(law.term.axis), law.expression,
                              others > 0 ? fmt::format(" or one of {} others", others) : std::string(),
                              law.effect.empty() ? std::string() : fmt::format(" ({})", law.effect)));
  }
  for (std::string& words : words_of(found.processes)) {
    all.push_back(std::move(words));
  }
  const bool another = found.instead && found.instead->odds > worth_a_word;
  return first_of(std::move(all), "; ", "; ") + (another ? "; or " + instead_words(*found.instead) : std::string());
}

std::string instead_words(const discovery::OtherExplanation& instead) {
  std::vector<std::string> all;
  for (const discovery::OtherExplanation::Law& law : instead.laws) {
    all.push_back(fmt::format("{} follows {}", name_of_axis(law.axis), law.expression));
  }
  for (std::string& words : words_of(instead.processes)) {
    all.push_back(std::move(words));
  }
  return fmt::format("in place of all that {} (odds {:.2g})", first_of(std::move(all), " and ", " "), instead.odds);
}

std::string laws_words(const diagnosis::LawsInstead& instead) {
  std::vector<std::string> all;
  for (const diagnosis::LawsInstead::Law& law : instead.laws) {
    all.push_back(law.process.empty() ? fmt::format("{} follows {}", law.axis, law.expression)
                                      : fmt::format("{} {}", law.axis, takes_offsets));
  }
  return first_of(std::move(all), " and ", " ");
}

bool in_place_of_some(const diagnosis::Diagnosis& d) {
  return std::any_of(d.model.begin(), d.model.end(), [&](const diagnosis::ModelEffect& m) {
    return m.effect->sensor != nullptr &&
           std::find(d.instead->names.begin(), d.instead->names.end(), m.effect) == d.instead->names.end();
  });
}

std::string in_place_words(const diagnosis::Diagnosis& d) {
  std::vector<std::string> names;
  for (const diagnosis::Effect* name : d.instead->names) {
    names.emplace_back(name->id);
  }
  return fmt::format(
      "{} {} (odds {:.2g})",
      in_place_of_some(d) ? fmt::format("in the place of {}", fmt::join(names, " and ")) : "in its place",
      laws_words(*d.instead), d.instead->odds);
}

bool doubtful(const diagnosis::Diagnosis& d) { return d.instead && d.instead->odds > worth_a_word; }

const char* beyond_what(const Discovery& found) {
  const bool known =
      std::any_of(found.laws.begin(), found.laws.end(), [](const DiscoveredLaw& law) { return !law.effect.empty(); });
  return known ? "what the catalogue alone does not explain" : "what no catalogue holds";
}

std::string law_figures(const Discovery& found) {
  std::vector<std::string> all;
  for (const DiscoveredLaw& law : found.laws) {
    all.push_back(fmt::format("{}: ({}) * {}", name_of_axis(law.term.axis),
                              with_sigma(law.coefficient, law.sigma, std::string(unit_of_axis(law.term.axis))),
                              law.expression));
  }
  for (const DiscoveredProcess& p : found.processes) {
    all.push_back(fmt::format("{}: {}, {}", name_of_axis(p.axis), discovery::name_of(p.kind),
                              with_sigma(p.size, p.sigma, process_unit(p))));
  }
  all.resize(std::min(all.size(), most_told));
  return fmt::format("{}", fmt::join(all, "; "));
}

std::string discovered_figures(const Discovery& found) {
  const auto nis = [&](double misfit) { return 1.0 + misfit / std::max(1.0, found.rows); };
  return fmt::format("{}; NIS {:.3g} becomes {:.3g}", law_figures(found), nis(found.misfit_before),
                     nis(misfit_left(found)));
}

void add_discovery(ordered_json& document, const Discovery& found) {
  document["discovered"] = ordered_json::array();
  for (const DiscoveredLaw& law : found.laws) {
    document["discovered"].push_back(law_json(law));
  }
  document["described"] = ordered_json::array();
  for (const DiscoveredLaw& law : found.described) {
    document["described"].push_back(law_json(law));
  }
  document["processes"] = ordered_json::array();
  for (const DiscoveredProcess& p : found.processes) {
    document["processes"].push_back({{"axis", name_of_axis(p.axis)},
                                     {"process", discovery::name_of(p.kind)},
                                     {"coefficient", p.size},
                                     {"sigma", p.sigma},
                                     {"unit", unit_of_axis(p.axis)},
                                     {"log_likelihood_gain", p.log_likelihood_gain}});
  }
  if (found.instead) {
    ordered_json laws = ordered_json::array(), processes = ordered_json::array();
    for (const discovery::OtherExplanation::Law& law : found.instead->laws) {
      laws.push_back({{"axis", name_of_axis(law.axis)}, {"expression", law.expression}});
    }
    for (const DiscoveredProcess& p : found.instead->processes) {
      processes.push_back({{"axis", name_of_axis(p.axis)}, {"process", discovery::name_of(p.kind)}});
    }
    document["instead"] = {{"laws", laws}, {"processes", processes}, {"odds", found.instead->odds}};
  }
  document["discovery"] = {{"functions_tried", found.functions_tried},
                           {"misfit_before", found.misfit_before},
                           {"misfit_after", found.misfit_after},
                           {"explained_share", explained_share(found)},
                           {"refused", found.refused}};
}

}  // namespace selfcal
