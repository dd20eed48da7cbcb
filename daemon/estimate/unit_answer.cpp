#include "daemon/estimate/unit_answer.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/diagnosis_json.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal {

using nlohmann::ordered_json;

std::vector<discovery::DiagnosedRecording> recordings_of(std::span<const DiagnosedFile> files) {
  std::vector<discovery::DiagnosedRecording> all;
  for (const DiagnosedFile& file : files) {
    all.push_back({file.data, file.diagnosis});
  }
  return all;
}

tl::expected<std::optional<discovery::JointFit>, std::string> fit_together(const discovery::UnexplainedRest& rest,
                                                                           discovery::Discovery& found,
                                                                           diagnosis::Diagnosis& first,
                                                                           const std::stop_token& stop) {
  const bool one = rest.recordings().size() == 1;
  if (one && (rest.taken_out().empty() || found.fit.terms.empty())) {
    return std::nullopt;
  }
  auto joint = rest.beside(found.fit.terms, found.fit.coefficient, stop);
  if (!joint) {
    return tl::unexpected(joint.error());
  }
  discovery::adopt(*joint, found);
  if (found.processes.empty()) {
    discovery::adopt(*joint, first);
  }
  return std::move(*joint);
}

Together put_together(std::span<const DiagnosedFile> recordings, const discovery::UnexplainedRest& rest,
                      const discovery::JointFit& joint) {
  Together together;
  for (const DiagnosedFile& r : recordings) {
    together.recordings.push_back({r.file, r.diagnosis.verdict, {}});
    for (const diagnosis::Finding& finding : r.diagnosis.findings) {
      together.recordings.back().names.push_back(finding.effect);
    }
  }
  for (const diagnosis::Effect* effect : rest.taken_out()) {
    together.taken_out.emplace_back(effect->id);
  }
  together.shared = joint.shared;
  return together;
}

std::optional<discovery::NextExperiment> plan_next(std::span<const discovery::UnitRecording> unit,
                                                   const discovery::Discovery& found,
                                                   const discovery::ExperimentLimits& limits,
                                                   const std::stop_token& stop) {
  std::optional<discovery::NextExperiment> next;
  const auto plan = [&](const discovery::DiscoveredLaw& law) {
    auto planned = discovery::plan_experiment(unit, law, limits, stop);
    if (planned && (!next || planned->separation_now < next->separation_now)) {
      next = std::move(planned);
    }
  };
  for (const discovery::DiscoveredLaw& law : found.laws) {
    plan(law);
  }
  for (const discovery::DiscoveredLaw& law : found.described) {
    if (law.unsure) {  // of the others no member is the law
      plan(law);
    }
  }
  return next;
}

namespace {

ordered_json fitted_json(const diagnosis::Effect& effect, const discovery::EffectFit& fit) {
  ordered_json parameters = ordered_json::array();
  for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
    const diagnosis::EffectParameter& p = effect.parameters[k];
    const auto at = static_cast<Eigen::Index>(k);
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"value", fit.size(at) * p.typical},
                          {"sigma", fit.sigma(at) * p.typical}});
  }
  if (!std::isnan(fit.constant)) {
    parameters.push_back({{"name", effect.constant.name},
                          {"unit", effect.constant.unit},
                          {"value", fit.constant},
                          {"sigma", fit.constant_sigma}});
  }
  return {{"recording", fit.recording}, {"parameters", parameters}};
}

}  // namespace

ordered_json fitted_effects_json(const discovery::JointFit& joint) {
  ordered_json all = ordered_json::array();
  for (std::size_t e = 0; e < joint.effects.size(); ++e) {
    const discovery::FittedEffect& effect = joint.effects[e];
    ordered_json each = ordered_json::array(), differing = ordered_json::array(), entangled = ordered_json::array();
    for (const discovery::EffectFit& fit : effect.each) {
      each.push_back(fitted_json(*effect.effect, fit));
    }
    for (std::size_t k = 0; k < effect.common.size(); ++k) {
      if (!effect.common[k]) {
        differing.push_back(name_of_coefficient(*effect.effect, static_cast<int>(k)));
      }
    }
    for (const discovery::Entangled& one : joint.entangled) {
      if (one.effect == e) {
        entangled.push_back({{"law", fmt::format("{} {}", name_of_axis(one.axis), one.expression)},
                             {"recording", one.recording},
                             {"name", name_of_coefficient(*effect.effect, one.coefficient)},
                             {"correlation", one.correlation}});
      }
    }
    all.push_back({{"effect", effect.effect->id},
                   {"common", effect.all_common()},
                   {"log_p_common", effect.log_p_common},
                   {"log_p_none", effect.log_p_none},
                   {"free", differing},
                   {"recordings", each},
                   {"entangled", entangled}});
  }
  return all;
}

std::string name_of_coefficient(const diagnosis::Effect& effect, int coefficient) {
  const auto at = static_cast<std::size_t>(coefficient);
  return at < effect.parameters.size() ? effect.parameters[at].name : std::string(effect.constant.name);
}

ordered_json together_json(const Together& together) {
  ordered_json recordings = ordered_json::array();
  const discovery::SharedParameters& shared = together.shared;
  for (std::size_t k = 0; k < together.recordings.size(); ++k) {
    const Together::Recording& r = together.recordings[k];
    ordered_json parameters = ordered_json::array();
    for (std::size_t p = 0; p < sensor_parameters.size(); ++p) {
      const auto at = static_cast<Eigen::Index>(p);
      parameters.push_back({{"name", sensor_parameters[p].name},
                            {"unit", sensor_parameters[p].unit},
                            {"value", shared.parameters[k](at) / sensor_parameters[p].si_per_unit},
                            {"sigma", std::sqrt(shared.covariance[k](at, at)) / sensor_parameters[p].si_per_unit}});
    }
    recordings.push_back({{"input", {{"name", r.file.name}, {"sha256", r.file.sha256}}},
                          {"verdict", verdict_name(r.verdict)},
                          {"findings", r.names},
                          {"parameters", parameters}});
  }
  ordered_json differing = ordered_json::array();
  for (const discovery::UnsharedParameter& d : shared.differing) {
    const SensorParameter& parameter = sensor_parameters.at(static_cast<std::size_t>(d.parameter));
    differing.push_back({{"name", parameter.name},
                         {"unit", parameter.unit},
                         {"recording", d.recording},
                         {"difference", d.difference / parameter.si_per_unit},
                         {"sigma", d.sigma / parameter.si_per_unit}});
  }
  return {{"recordings", recordings},
          {"taken_out", together.taken_out},
          {"shared",
           {{"scale_factors_and_misalignments", shared.lasting_shared},
            {"log_p_scale_factors_and_misalignments", shared.log_p_lasting},
            {"biases", shared.biases_shared},
            {"log_p_biases", shared.log_p_biases},
            {"differing", differing}}}};
}

void add_next_experiment(ordered_json& document, const std::optional<discovery::NextExperiment>& next) {
  if (next) {
    ordered_json positions = ordered_json::array();
    for (const GimbalPosition& p : next->schedule.positions) {
      positions.push_back({p.outer_deg, p.inner_deg});
    }
    document["next_experiment"] = {
        {"schedule",
         {{"positions", positions}, {"dwell_s", next->schedule.dwell_s}, {"rotation_s", next->schedule.rotation_s}}},
        {"splits", next->closest.empty() ? ordered_json::array() : ordered_json{next->closest}},
        {"separation_sigma", next->separation},
        {"separation_now_sigma", next->separation_now},
        {"expected_odds", std::exp(std::min(next->log_odds, 700.0))}};
  }
}

}  // namespace selfcal
