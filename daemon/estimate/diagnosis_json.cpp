#include "daemon/estimate/diagnosis_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/effect_words.hpp"
#include "daemon/estimate/left_out.hpp"
#include "estimator/geometry/sensor_parameters.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/law_file/law_file.hpp"

namespace selfcal {
namespace {

using diagnosis::Adequacy;
using diagnosis::Finding;
using diagnosis::Located;
using nlohmann::ordered_json;

ordered_json to_json(const Located& l) {
  ordered_json j;
  j["where"] = l.where;
  if (l.position > 0) {
    j["position"] = l.position;
  }
  j["axis"] = l.axis;
  j["significance"] = l.significance;
  if (l.end_s > l.start_s) {  // a place in time
    j["start_s"] = l.start_s;
    j["end_s"] = l.end_s;
  }
  j["bias"] = l.size;
  j["unit"] = l.axis.starts_with("gyro") ? "deg/h" : "ug";
  j["words"] = l.words;
  return j;
}

ordered_json to_json(const Finding& f) {
  ordered_json j;
  j["effect"] = f.effect;
  j["equation"] = f.equation;
  j["where"] = f.excited;
  j["parameters"] = ordered_json::array();
  for (const auto& p : f.parameters) {
    j["parameters"].push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"sigma", p.sigma}});
  }
  j["equivalent"] = f.equivalent;
  j["experiment"] = f.experiment;
  for (const Symbol& symbol : symbols_of(f.equation)) {
    j["symbols"][symbol.name] = symbol.meaning;
  }
  j["significance"] = f.significance;
  j["share"] = f.share;
  j["stochastic"] = f.stochastic;
  j["evidence"] = {{"delta_bic", f.delta_bic},
                   {"p_value", std::exp(f.log_p)},
                   {"log10_p", f.log_p / std::log(10.0)},
                   {"held_out_gain", f.held_out_gain},
                   {"probability", f.probability}};
  return j;
}

ordered_json to_json(const Adequacy& a) {
  return {{"accepted", a.accepted},
          {"nis", a.nis},
          {"whiteness_log10_p", a.coloured ? ordered_json() : ordered_json(a.log_p_white / std::log(10.0))},
          {"largest_located_sigma", a.largest_sigma},
          {"misfit", a.misfit}};
}

template <typename T>
ordered_json list(const std::vector<T>& all) {
  ordered_json j = ordered_json::array();
  for (const T& one : all) {
    j.push_back(to_json(one));
  }
  return j;
}

ordered_json to_json(const diagnosis::Remainder& r) {
  ordered_json forms = ordered_json::array();
  for (const diagnosis::FormLeft& f : r.forms) {
    forms.push_back({{"effect", f.effect}, {"words", f.words}, {"share", f.share}});
  }
  return {{"share", r.share}, {"sigma", r.sigma}, {"forms", forms}, {"places", list(r.places)}};
}

ordered_json to_json(const diagnosis::LawsInstead& instead) {
  ordered_json laws = ordered_json::array();
  for (const diagnosis::LawsInstead::Law& law : instead.laws) {
    laws.push_back({{"axis", law.axis},
                    {"expression", law.expression},
                    {"process", law.process},
                    {"coefficient", law.coefficient},
                    {"sigma", law.sigma},
                    {"unit", unit_of_axis(law.place)}});
  }
  ordered_json names = ordered_json::array();
  for (const diagnosis::Effect* name : instead.names) {
    names.push_back(name->id);
  }
  return {{"laws", laws}, {"names", names}, {"odds", instead.odds}};
}

ordered_json list(std::vector<diagnosis::Located> places, const std::vector<diagnosis::Located>& by) {
  places.insert(places.end(), by.begin(), by.end());
  return list(places);
}

ordered_json to_json(const diagnosis::VelocityJump& jump) {
  ordered_json j = {{"start_s", jump.start_s}, {"end_s", jump.end_s}};
  for (const int axis : {0, 1, 2}) {
    const std::string name(1, "xyz"[axis]);
    j[name] = jump.size_b(axis);
    j["sigma_" + name] = jump.sigma_b(axis);
  }
  j["unit"] = "m/s";
  return j;
}

}  // namespace

std::string verdict_name(diagnosis::DiagnosisVerdict verdict) {
  switch (verdict) {
    case diagnosis::DiagnosisVerdict::adequate: return "adequate";
    case diagnosis::DiagnosisVerdict::named: return "named";
    case diagnosis::DiagnosisVerdict::none_of_the_above: return "none of the above";
    case diagnosis::DiagnosisVerdict::not_enough_information: return "not enough information";
    case diagnosis::DiagnosisVerdict::data_fault: return "data fault";
  }
  return {};
}

ordered_json diagnosis_json(const diagnosis::Diagnosis& diagnosis, double false_alarm_rate,
                            const document::InputFile& input, const discovery::Discovery* beyond) {
  const auto d = with_laws(diagnosis, beyond);
  ordered_json j = document::head(document::diagnosis, input);
  if (!input.name.empty()) {
    j["summary"] = summary_json(summary_of(d, {input.name, 0}, beyond));
  }
  j["mismatch"] = d.mismatch;
  j["verdict"] = verdict_name(d.verdict);
  j["false_alarm_rate"] = false_alarm_rate;
  j["adequacy"] = {{"before", to_json(d.before)}, {"after", to_json(d.after)}};
  j["located"] = list(d.located, d.located_by);
  j["findings"] = list(d.findings);
  j["undetectable_here"] = ordered_json::array();
  j["expected_z"] = ordered_json::object();
  for (const auto& u : d.undetectable) {
    j["undetectable_here"].push_back(u.effect->id);
    j["expected_z"][u.effect->id] = u.expected_z;
  }
  for (const auto& u : d.detectable) {
    j["expected_z"][u.effect->id] = u.expected_z;
  }
  j["unexplained"] = d.unexplained;
  if (d.remainder) {
    j["remainder"] = to_json(*d.remainder);
  }
  if (d.instead) {
    j["instead_of_names"] = to_json(*d.instead);
  }
  j["rejected"] = list(d.rejected);
  j["suspected"] = list(d.suspected);
  j["remaining"] = list(d.remaining, d.remaining_by);
  j["data_faults"] = ordered_json::array();
  for (const auto& f : d.faults) {
    j["data_faults"].push_back(
        {{"id", f.id}, {"words", f.words}, {"first_sample", f.first_sample}, {"count", f.count}});
  }
  if (!d.calibration.left_out.empty()) {
    j["left_out"] = left_out_json(d.calibration);
  }
  if (!d.jumps.empty()) {
    j["velocity_jumps"] = ordered_json::array();
    for (const auto& jump : d.jumps) {
      j["velocity_jumps"].push_back(to_json(jump));
    }
  }
  if (d.loudest > 1.0) {
    j["accel_noise_loudest_tenth"] = d.loudest;
  }
  j["nothing_turned"] = d.nothing_turned;
  if (d.base_tilt) {
    j["base_tilt"] = {{"range_arcmin", 60.0 * d.base_tilt->range / units::degree},
                      {"correlation", d.base_tilt->correlation},
                      {"apart_arcmin", 60.0 * d.base_tilt->apart / units::degree}};
  }
  if (d.attitude_wanders > 0.0) {
    j["attitude_wanders_mrad"] = 1e3 * d.attitude_wanders;
  }
  if (d.read_out_delay) {
    j["read_out_delay"] = {{"delay_s", d.read_out_delay->delay_s}, {"sigma_s", d.read_out_delay->sigma_s}};
  }
  j["base"] = d.calibration.moored ? "moored" : "still";
  j["parameters"] = ordered_json::array();
  for (int k = 0; k < sensor_parameter_count; ++k) {
    const SensorParameter& p = sensor_parameters[static_cast<std::size_t>(k)];
    j["parameters"].push_back({{"name", p.name},
                               {"unit", p.unit},
                               {"value", d.value(k) / p.si_per_unit},
                               {"sigma", d.sigma(k) / p.si_per_unit},
                               {"value_without", d.calibration.value(k) / p.si_per_unit},
                               {"sigma_without", d.calibration.sigma(k) / p.si_per_unit}});
  }
  if (beyond != nullptr) {
    add_discovery(j, *beyond);
  }
  return j;
}

}  // namespace selfcal
