#include "tools/report/noise_document.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/geometry/units.hpp"
#include "tools/report/noise_terms.hpp"
#include "tools/report/page.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

struct TermName {
  const char* kind;  // the same for both kinds of sensor
  const char* name;
  const char* unit;
  double si_per_unit;
};

constexpr double sqrt_hour = 60.0;   // of 3600 s
constexpr double micrometre = 1e-6;  // m

// As data sheets have them. In the order of NoiseTerm.
constexpr std::array<TermName, noise_term_count> gyro_terms = {{
    {"quantisation", "quantisation", "″", units::arcsecond},
    {"random walk", "angle random walk", "°/√h", units::degree_per_sqrt_hour},
    {"bias instability", "bias instability", "°/h", units::degree_per_hour},
    {"rate random walk", "rate random walk", "°/h/√h", units::degree_per_hour / sqrt_hour},
    {"ramp", "rate ramp", "°/h/h", units::degree_per_hour / units::hour},
}};
constexpr std::array<TermName, noise_term_count> accelerometer_terms = {{
    {"quantisation", "quantisation", "µm/s", micrometre},
    {"random walk", "velocity random walk", "µg/√Hz", units::micro_g_per_sqrt_hz},
    {"bias instability", "bias instability", "µg", units::micro_g},
    {"rate random walk", "acceleration random walk", "µg/√s", units::micro_g},
    {"ramp", "acceleration ramp", "µg/h", units::micro_g / units::hour},
}};

Json sensor_json(const std::vector<AllanPoint>& points, std::size_t sensor) {
  const bool gyro = sensor < 3;
  const auto& names = gyro ? gyro_terms : accelerometer_terms;
  const double unit = gyro ? units::degree_per_hour : units::micro_g;
  const NoiseFit fit = fit_noise_terms(points, sensor);
  Json known = Json::array();
  for (const TermName& name : names) {
    known.push_back({{"kind", name.kind}, {"name", name.name}, {"unit", name.unit}});
  }
  Json terms = Json::array();
  for (const NoiseTermFit& term : fit.terms) {
    const TermName& name = names[static_cast<std::size_t>(term.term)];
    terms.push_back({{"kind", name.kind},
                     {"name", name.name},
                     {"value", rounded(term.coefficient / name.si_per_unit)},
                     {"sigma", rounded(term.sigma / name.si_per_unit)},
                     {"unit", name.unit},
                     {"slope", slope_of(term.term)},
                     {"at_one_second", rounded(deviation_of(term, 1.0) / unit)}});
  }
  const char axis = "xyz"[sensor % 3];
  return {{"sensor", std::string(gyro ? "gyro " : "accelerometer ") + axis},
          {"misfit", rounded(fit.misfit)},
          {"known", std::move(known)},
          {"terms", std::move(terms)}};
}

}  // namespace

Json noise_document(const Recording& recording) {
  std::vector<double> first_temperature;
  const ImuData data = imu_view(recording, first_temperature);
  const std::vector<AllanPoint> points = allan_deviation(recording, find_segments(data));
  Json tau = Json::array();
  Json relative = Json::array();
  std::array<Json, 6> columns;
  columns.fill(Json::array());
  for (const AllanPoint& point : points) {
    tau.push_back(rounded(point.tau_s));
    relative.push_back(rounded(1.0 / std::sqrt(2.0 * point.freedom)));
    for (std::size_t sensor = 0; sensor < columns.size(); ++sensor) {
      const double unit = sensor < 3 ? units::degree_per_hour : units::micro_g;
      columns[sensor].push_back(rounded(point.deviation[sensor] / unit));
    }
  }
  Json sensors = Json::array();
  for (std::size_t sensor = 0; sensor < columns.size(); ++sensor) {
    sensors.push_back(sensor_json(points, sensor));
  }
  return {{"tau_s", std::move(tau)},
          {"gyro_deg_per_h", {columns[0], columns[1], columns[2]}},
          {"accel_ug", {columns[3], columns[4], columns[5]}},
          {"relative_sigma", std::move(relative)},
          {"sensors", std::move(sensors)}};
}

}  // namespace selfcal::report
