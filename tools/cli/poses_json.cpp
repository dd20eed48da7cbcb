#include "tools/cli/poses_output.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimator/geometry/units.hpp"
#include "tools/cli/head_output.hpp"
#include "tools/cli/poses_attitude_output.hpp"
#include "tools/cli/poses_words.hpp"
#include "tools/cli/rest_output.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;

Json ids(const std::vector<const diagnosis::Effect*>& effects) { return diagnosis::ids_of(effects); }

Json to_json(const std::vector<diagnosis::PoseEffect>& effects) {
  Json all = Json::array();
  for (const diagnosis::PoseEffect& e : effects) {
    Json j = {{"effect", e.effect->id}, {"log10_p", e.log_p / std::log(10.0)}, {"held_out_rms", e.held_out_rms}};
    j["parameters"] = Json::array();
    for (std::size_t k = 0; k < e.value.size(); ++k) {
      j["parameters"].push_back({{"name", e.parameters[k]}, {"value", e.value[k]}, {"sigma", e.sigma[k]}});
    }
    j["equivalent"] = ids(e.equivalent);
    j["may_be_flicker"] = e.may_be_flicker;
    j["may_be_earth"] = e.may_be_earth;
    if (!std::isnan(e.constant)) {
      j["constant"] = e.constant;
    }
    all.push_back(std::move(j));
  }
  return all;
}

Json to_json(const std::vector<diagnosis::PoseParameter>& parameters) {
  Json all = Json::array();
  for (const diagnosis::PoseParameter& p : parameters) {
    all.push_back(
        {{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"sigma", p.sigma}, {"determined", p.determined}});
  }
  return all;
}

Json to_json(const std::vector<diagnosis::Clipping>& clipped) {
  Json all = Json::array();
  for (const diagnosis::Clipping& c : clipped) {
    all.push_back({{"sensor", c.gyro ? "gyro" : "accelerometer"},
                   {"axis", std::string(1, "xyz"[c.axis])},
                   {"limit", c.limit},
                   {"samples", c.samples},
                   {"first_s", c.first_s},
                   {"last_s", c.last_s}});
  }
  return all;
}

Json to_json(const std::vector<diagnosis::LeftOut>& stretches) {
  Json all = Json::array();
  for (const diagnosis::LeftOut& out : stretches) {
    all.push_back({{"first_s", out.first_s}, {"last_s", out.last_s}, {"samples", out.samples}, {"words", out.words}});
  }
  return all;
}

// null for an axis that the log does not hold.
Json held(const std::array<double, 3>& values, const std::array<bool, 3>& axes) {
  Json all = Json::array();
  for (std::size_t k = 0; k < values.size(); ++k) {
    all.push_back(axes[k] ? Json(values[k]) : Json());
  }
  return all;
}

// Of a log without gyros, or of a stand whose mean is told under `rest`, there is none.
std::array<bool, 3> axes_with_bias(const diagnosis::PoseDiagnosis& d) {
  std::array<bool, 3> axes = d.gyro_axes;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    axes[k] = axes[k] && d.gyro_bias_sigma[k] > 0.0;
  }
  return axes;
}

Json array(const Vector3& v) { return Json{v.x(), v.y(), v.z()}; }

Json jump_json(const diagnosis::AccelJump& j) {
  return {{"from_pose", j.from_pose},
          {"to_pose", j.to_pose},
          {"from_s", j.from_s},
          {"to_s", j.to_s},
          {"size_g", {j.size_g.x(), j.size_g.y(), j.size_g.z()}},
          {"sigma_g", {j.sigma_g.x(), j.sigma_g.y(), j.sigma_g.z()}}};
}

Json to_json(const std::vector<diagnosis::BiasJump>& jumps) {
  Json all = Json::array();
  for (const diagnosis::BiasJump& j : jumps) {
    all.push_back({{"gap", j.gap}, {"time_s", j.time_s}, {"size", array(j.size)}, {"sigma", array(j.sigma)}});
  }
  return all;
}

Json axis_json(const diagnosis::ReadOutAxis& a) {
  const Eigen::Index k = main_axis(a);
  Json j = {{"axis", a.name},
            {"by", a.steady       ? "steady rates"
                   : a.oscillates ? "oscillation"
                                  : "turns from stop to stop"},
            {"rows", a.rows},
            {"turned_deg", a.turned_deg},
            {"response", array(a.response)},
            {"response_sigma", array(a.sigma)},
            {"along", std::string(1, "xyz"[k])},
            {"reversed", a.response(k) < 0.0},
            {"of_a_positive_turn", array(across(a))},
            {"gain", std::abs(a.response(k))},
            {"gain_sigma", a.sigma(k)}};
  if (!a.steady && !a.oscillates) {
    j["turn_scatter"] = a.turn_scatter;
    j["turns_alike"] = a.turns_alike;
  }
  if (a.nonlinearity) {
    j["nonlinearity"] = {{"value", a.nonlinearity->value},
                         {"sigma", a.nonlinearity->sigma},
                         {"named", a.nonlinearity->determined},
                         {"log10_p", a.log_p_nonlinear / std::log(10.0)}};
  }
  return j;
}

Json read_outs_json(const diagnosis::ReadOuts& r) {
  Json axes = Json::array();
  for (const diagnosis::ReadOutAxis& a : r.axes) {
    axes.push_back(axis_json(a));
  }
  Json j = {{"axes", axes},
            {"disagreeing", r.disagreeing},
            {"clipped_turns", r.clipped_turns},
            {"clipped_rates", r.clipped_rates},
            {"gyro_bias", array(r.gyro_bias)},
            {"gyro_bias_sigma", array(r.gyro_bias_sigma)}};
  if (r.clock) {
    j["clock"] = {{"turns", r.clock->turns},
                  {"delay_s", r.clock->delay_s},
                  {"delay_sigma_s", r.clock->delay_sigma_s},
                  {"growth_s", r.clock->growth_s},
                  {"growth_sigma_s", r.clock->growth_sigma_s},
                  {"faster", r.clock->faster},
                  {"faster_sigma", r.clock->faster_sigma},
                  {"least_s", r.clock->least_s},
                  {"most_s", r.clock->most_s},
                  {"scatter_s", r.clock->scatter_s}};
  }
  if (r.tilt) {
    j["tilt"] = {{"axis", r.tilt->axis},
                 {"near_vertical", r.tilt->near_vertical},
                 {"tilt_deg", r.tilt->tilt_deg},
                 {"sigma_deg", r.tilt->sigma_deg},
                 {"log10_p_shape", r.tilt->log_p_shape / std::log(10.0)}};
  }
  return j;
}

Json noise_json(const std::vector<diagnosis::RestNoise>& all) {
  Json points = Json::array();
  for (const diagnosis::RestNoise& n : all) {
    points.push_back({{"tau_s", n.tau_s}, {"deviation", n.deviation}, {"freedom", n.freedom}});
  }
  return points;
}

// What stands for it as well, over all that is named.
std::string rivals_of(const diagnosis::PoseDiagnosis& d) {
  std::vector<std::string> all;
  for (const diagnosis::PoseEffect& e : d.gyro_named) {
    const std::vector<std::string> ids = diagnosis::ids_of(e.equivalent);
    all.insert(all.end(), ids.begin(), ids.end());
    if (e.may_be_flicker) {
      all.emplace_back("a bias that wanders by itself");
    }
    if (e.may_be_earth) {
      all.emplace_back("the Earth's rate");
    }
  }
  return all.empty() ? std::string() : fmt::format("Or as well {}.", fmt::join(all, ", "));
}

// The verdict in a sentence, and what tells more.
Json verdict_of(const diagnosis::PoseDiagnosis& d) {
  std::vector<std::string> named, drifts_as_well;
  for (const auto* effects : {&d.gyro_named, &d.accel_named}) {
    for (const diagnosis::PoseEffect& e : *effects) {
      (e.may_be_flicker ? drifts_as_well : named).push_back(e.effect->id);
    }
  }
  if (d.settling) {
    named.emplace_back("accel_relaxation");
  }
  std::string verdict = d.by_poses ? "Nothing named beyond bias, scale factor and misalignment."
                        : d.rest   ? "Nothing drifts by more than slow noise makes."
                                   : "Nothing named.";
  std::string next;
  if (!named.empty()) {
    verdict = fmt::format("Named: {}.", fmt::join(named, ", "));
    next = rivals_of(d).empty() ? "" : "The same poses once more in another order, just switched on, tell them apart.";
  } else if (!drifts_as_well.empty()) {
    verdict =
        fmt::format("The gyros' bias changes with time: it wanders by itself, or {}.", fmt::join(drifts_as_well, ", "));
    next = "The same poses once more, just switched on, tell them apart.";
  } else if (!d.gyro_jumps.empty()) {
    verdict = d.gyro_jumps.front().gap ? "The gyros' bias is another behind a gap of the log."
                                       : "The gyros' bias is another from one pose on.";
    next = "Give the parts of the log by themselves.";
  } else if (d.accel_jump) {
    verdict = "The accelerometers' bias is another from one pose on.";
    next = "Give the parts of the log by themselves.";
  } else if (d.by_poses && !d.accel_adequate) {
    verdict = fmt::format("Bias, scale factor and misalignment leave {:.2g} mg rms of the accelerometers.",
                          1e3 * d.accel_rms_g);
  } else if (d.dividing_head && (d.dividing_head->third || d.dividing_head->drift)) {
    verdict = d.dividing_head->third ? "A part of three times the head's angle is left beside bias, scale and square."
                                     : "The accelerometer drifts from stop to stop.";
  } else if (d.rest && drifts(*d.rest)) {
    verdict = "Readings change with time or temperature by more than slow noise makes.";
  }
  return {{"standing", poses_mismatch(d) || !d.gyro_jumps.empty() ? "open" : "good"},
          {"verdict", verdict},
          {"cause", rivals_of(d)},
          {"next", next}};
}

}  // namespace

nlohmann::ordered_json poses_json(const diagnosis::PoseDiagnosis& d) {
  Json settling;
  if (d.settling) {
    settling = {{"effect", "accel_relaxation"},           {"tau_s", d.settling->tau_s},
                {"with_change", d.settling->with_change}, {"size_g", array(d.settling->size_g)},
                {"sigma_g", array(d.settling->sigma_g)},  {"log10_p", d.settling->log_p / std::log(10.0)}};
  }
  Json confounded = Json::array();
  for (const diagnosis::Confounded& c : d.confounded) {
    confounded.push_back({{"effect", c.effect->id}, {"with", c.with->id}, {"shared", c.shared}});
  }
  const char* sensors = d.sensors == diagnosis::Sensors::gyros            ? "gyros"
                        : d.sensors == diagnosis::Sensors::accelerometers ? "accelerometers"
                                                                          : "both";
  return {{"summary", verdict_of(d)},
          {"mismatch", poses_mismatch(d)},
          {"sensors", sensors},
          {"poses", d.poses},
          {"static_s", d.static_seconds},
          {"duration_s", d.duration_s},
          {"moving", d.moving},
          {"other_forces_g", d.other_forces},
          {"forces_of_another_zero_g", d.forces_of_another_zero},
          {"by_poses", d.by_poses},
          {"supports", d.supports},
          {"not_by_position", d.not_by_position},
          {"read_outs", d.read_outs ? read_outs_json(*d.read_outs) : Json()},
          {"attitude", d.by_attitude ? attitude_json(*d.by_attitude) : Json()},
          {"means", d.means},
          {"dividing_head", d.dividing_head ? head_json(*d.dividing_head) : Json()},
          {"rest", d.rest ? rest_json(*d.rest) : Json()},
          {"clipped", to_json(d.clipped)},
          {"clipped_poses", d.clipped_poses},
          {"spikes", d.spikes},
          {"left_out", to_json(d.left_out)},
          {"accelerometers",
           {{"adequate", d.accel_adequate},
            {"tested", d.accel_tested},
            {"jump", d.accel_jump ? jump_json(*d.accel_jump) : Json()},
            {"noise_at_rest", noise_json(d.accel_noise)},
            {"rms_g", d.accel_rms_g},
            {"held_out_rms_g", d.accel_held_out_rms_g},
            {"force_at_rest_g", d.force_at_rest_g},
            {"gravity_span_deg", d.gravity_span_deg},
            {"parameters", to_json(d.accel_parameters)},
            {"settling", settling},
            {"findings", to_json(d.accel_named)},
            {"tried", to_json(d.accel_tried)}}},
          {"gyros",
           {{"bias", held(d.gyro_bias, axes_with_bias(d))},
            {"bias_sigma", held(d.gyro_bias_sigma, axes_with_bias(d))},
            {"jumps", to_json(d.gyro_jumps)},
            {"earth_taken_out", d.earth_taken_out},
            {"latitude_seen_deg", d.latitude_seen ? Json(*d.latitude_seen / units::degree) : Json()},
            {"latitude_seen_sigma_deg", d.latitude_seen ? Json(d.latitude_seen_sigma / units::degree) : Json()},
            {"accelerometers_reversed", d.accel_reversed},
            {"raw_unit_rad_s", d.gyro_raw_unit > 0.0 ? Json(d.gyro_raw_unit) : Json()},
            {"contradict", d.gyros_contradict},
            {"held_out_rms", d.gyro_held_out_rms},
            {"white_rms", d.gyro_white_rms},
            {"noise_at_rest", noise_json(d.gyro_noise)},
            {"parameters", to_json(d.gyro_parameters)},
            {"tried", to_json(d.gyro_tried)},
            {"findings", to_json(d.gyro_named)},
            {"open", to_json(d.gyro_open)},
            {"confounded", confounded}}},
          {"gravity_direction_deg",
           {{"turns", d.turns},
            {"turns_clipped", d.turns_clipped},
            {"turns_whole", d.turns_whole},
            {"before", d.direction_before / units::degree},
            {"after", d.direction_after / units::degree},
            {"by_noise", d.direction_by_noise / units::degree},
            {"held_out_before", d.direction_before_held_out / units::degree},
            {"held_out_after", d.direction_after_held_out / units::degree}}},
          {"invisible", d.invisible}};
}

bool names_nonlinearity(const diagnosis::PoseDiagnosis& d) {
  return d.read_outs && std::any_of(d.read_outs->axes.begin(), d.read_outs->axes.end(),
                                    [](const auto& a) { return a.nonlinearity && a.nonlinearity->determined; });
}

bool poses_mismatch(const diagnosis::PoseDiagnosis& d) {
  return !d.accel_adequate || !d.gyros_contradict.empty() || !d.accel_named.empty() || !d.gyro_named.empty() ||
         d.settling.has_value() || names_nonlinearity(d) ||
         (d.dividing_head && (d.dividing_head->third || d.dividing_head->drift)) || (d.rest && drifts(*d.rest));
}

}  // namespace selfcal::cli
