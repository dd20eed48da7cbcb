#include "daemon/estimate/result_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/diagnosis_json.hpp"
#include "daemon/estimate/left_out.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* name_of(PassDirection direction) {
  return direction == PassDirection::forward ? "forward" : "reverse";
}

constexpr const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::consistent: return "consistent";
    case Verdict::inconsistent: return "inconsistent";
    case Verdict::not_converged: break;
  }
  return "not converged";
}

Json parameters_json(const JudgedResult& judged, const CalibrationOptions& options) {
  const CalibrationResult& result = judged.result;
  Json list = Json::array();
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    const SensorParameter& parameter = sensor_parameters[k];
    const auto row = static_cast<Eigen::Index>(k);
    list.push_back({{"name", parameter.name},
                    {"unit", parameter.unit},
                    {"value", result.value[row] / parameter.si_per_unit},
                    {"sigma", result.sigma[row] / parameter.si_per_unit},
                    {"determined", result.determined[k]},
                    {"tolerance", options.tolerance[row] / parameter.si_per_unit},
                    {"plausible", result.plausible[k]},
                    {"usable", judged.gate.usable(static_cast<int>(k))}});
  }
  return list;
}

// The 24 in the table's units.
Json in_units(const ParameterVector& si) {
  Json list = Json::array();
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    list.push_back(si[static_cast<Eigen::Index>(k)] / sensor_parameters[k].si_per_unit);
  }
  return list;
}

Json passes_json(const CalibrationResult& result, bool curves) {
  Json list = Json::array();
  for (const PassSummary& pass : result.passes) {
    Json entry = {{"direction", name_of(pass.direction)},
                  {"seconds", pass.seconds},
                  {"nis_mean", pass.nis_mean},
                  {"largest_move_sigma", pass.largest_move_sigma}};
    if (curves) {
      entry["epoch_s"] = pass.epoch_s;
      entry["epoch_values"] = Json::array();
      entry["epoch_sigmas"] = Json::array();
      for (const ParameterVector& value : pass.epoch_parameters) {
        entry["epoch_values"].push_back(in_units(value));
      }
      for (const ParameterVector& sigma : pass.epoch_sigma) {
        entry["epoch_sigmas"].push_back(in_units(sigma));
      }
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json segments_json(const CalibrationResult& result) {
  Json list = Json::array();
  for (const SegmentSummary& segment : result.segments) {
    list.push_back({{"kind", segment.rotation ? "rotation" : "dwell"},
                    {"start_s", segment.start_s},
                    {"end_s", segment.end_s},
                    {"outer_deg", segment.outer_deg},
                    {"inner_deg", segment.inner_deg},
                    {"nis_mean", segment.nis_mean},
                    {"epochs", segment.epochs}});
  }
  return list;
}

Json undetermined_json(const CalibrationResult& result) {
  Json list = Json::array();
  for (const UndeterminedDirection& direction : result.undetermined) {
    Json components = Json::object();
    for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
      components[std::string(sensor_parameters[k].name)] = direction.direction[static_cast<Eigen::Index>(k)];
    }
    Json supply = Json::array();
    for (const SupplyingTurn& turn : direction.supply) {
      const Json positions = {{turn.from.outer_deg, turn.from.inner_deg}, {turn.to.outer_deg, turn.to.inner_deg}};
      supply.push_back({{"positions", positions}, {"sigma_in_tolerances", turn.sigma_after}});
    }
    list.push_back({{"words", direction.words},
                    {"supply", std::move(supply)},
                    {"sigma_in_tolerances", direction.sigma},
                    {"direction_in_tolerances", std::move(components)}});
  }
  return list;
}

Json correlation_json(const CalibrationResult& result) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < sensor_parameter_count; ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < sensor_parameter_count; ++j) {
      row.push_back(result.covariance(i, j) / std::sqrt(result.covariance(i, i) * result.covariance(j, j)));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string_view noise_source(const CalibrationResult& result) {
  return result.noise_given ? "given" : result.noise_of_drift ? "drift" : "spectra";
}

Json noise_json(const CalibrationResult& result) {
  Json walk = Json::array(), disturbed = Json::array();
  for (const MotionModel& motion : result.noise.observation.motion) {
    walk.push_back(walk_density(motion));
  }
  for (const Disturbance& d : result.noise.disturbed) {
    disturbed.push_back({{"start_s", d.start_s}, {"end_s", d.end_s}, {"variance_factor", d.factor}});
  }
  return {{"source", noise_source(result)},
          {"gyro_arw_deg_per_sqrt_h", result.gyro_arw / units::degree_per_sqrt_hour},
          {"accel_vrw_ug_per_sqrt_hz", result.accel_vrw / units::micro_g_per_sqrt_hz},
          {"position_sigma_m", result.position_sigma},
          {"position_walk_m_per_sqrt_s", std::move(walk)},
          {"disturbed", std::move(disturbed)},
          {"gyro_quantum_arcsec", result.gyro_quantum / units::arcsecond},
          {"accel_quantum_m_per_s", result.accel_quantum},
          {"base", result.moored ? "moored" : "still"}};
}

Json consistency_json(const Consistency& consistency) {
  return {{"verdict", name_of(consistency.verdict)},
          {"words", consistency.words},
          {"nis_mean", consistency.nis_mean},
          {"nis_low", consistency.nis_low},
          {"nis_high", consistency.nis_high},
          {"whiteness_p_value", consistency.whiteness_p_value},
          {"parity_max_sigma", consistency.parity_max_sigma},
          {"autocorrelation", consistency.autocorrelation}};
}

}  // namespace

nlohmann::ordered_json result_json(const JudgedResult& judged, const CalibrationOptions& options,
                                   const Recording& recording, const std::vector<std::string>& warnings, bool curves,
                                   const document::InputFile& input) {
  const CalibrationResult& result = judged.result;
  const Attitude& attitude = result.initial_attitude;
  Json document = document::head(document::estimate, input);
  document.update({{"serial", recording.serial},
                   {"summary", summary_json(judged.summary)},
                   {"acceptable", judged.gate.acceptable()},
                   {"objections", judged.gate.words()},
                   {"parameters", parameters_json(judged, options)},
                   {"initial_attitude_deg",
                    {{"roll", attitude.roll / units::degree},
                     {"pitch", attitude.pitch / units::degree},
                     {"heading", attitude.heading / units::degree}}},
                   {"attitude_sigma_deg",
                    {{"north", result.attitude_sigma.x() / units::degree},
                     {"up", result.attitude_sigma.y() / units::degree},
                     {"east", result.attitude_sigma.z() / units::degree}}},
                   {"consistency", consistency_json(result.consistency)},
                   {"undetermined", undetermined_json(result)},
                   {"noise", noise_json(result)},
                   {"covariance_carried", options.carried_covariance},
                   {"passes", passes_json(result, curves)},
                   {"segments", segments_json(result)},
                   {"elapsed_s", result.elapsed_s},
                   {"samples", recording.size()},
                   {"duration_s", static_cast<double>(recording.size()) / recording.sample_rate_hz},
                   {"sample_rate_hz", recording.sample_rate_hz},
                   {"site",
                    {{"latitude_deg", recording.latitude_deg},
                     {"longitude_deg", recording.longitude_deg},
                     {"height_m", recording.height_m}}},
                   {"start_time_utc", recording.start_time_utc},
                   {"warnings", warnings}});
  if (!result.left_out.empty()) {
    document["left_out"] = left_out_json(result);
  }
  if (curves) {
    document["correlation"] = correlation_json(result);
  }
  if (judged.diagnosis) {
    document["diagnosis"] = diagnosis_json(*judged.diagnosis, diagnosis::DiagnosisOptions().false_alarm_rate, {},
                                           judged.beyond ? &*judged.beyond : nullptr);
  }
  return document;
}

std::string result_json_text(const JudgedResult& judged, const CalibrationOptions& options, const Recording& recording,
                             const std::vector<std::string>& warnings, bool curves, const document::InputFile& input) {
  return result_json(judged, options, recording, warnings, curves, input).dump();
}

}  // namespace selfcal
