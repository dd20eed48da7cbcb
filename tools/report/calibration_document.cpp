#include "tools/report/report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "daemon/calibration/calibrate_recording.hpp"
#include "daemon/calibration/result_json.hpp"
#include "estimator/geometry/units.hpp"
#include "tools/report/allan_deviation.hpp"
#include "tools/report/page_assets.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double curve_digits = 6.0;          // of a plotted number: far below a pixel
constexpr std::size_t gimbal_points = 1500;   // a point a pixel on a wide screen

double rounded(double value) {
  if (value == 0.0 || !std::isfinite(value)) {
    return value;
  }
  const double scale = std::pow(10.0, curve_digits - 1.0 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

void round_numbers(Json& value) {
  if (value.is_number_float()) {
    value = rounded(value.get<double>());
  } else if (value.is_array()) {
    std::for_each(value.begin(), value.end(), round_numbers);
  }
}

// Curves only: the numbers of the tables stay as they are in the JSON.
void round_curves(Json& document) {
  for (Json& pass : document["passes"]) {
    for (const char* key : {"epoch_s", "epoch_values", "epoch_sigmas"}) {
      round_numbers(pass[key]);
    }
  }
  round_numbers(document["correlation"]);
}

// Both angles at every k-th sample.
Json gimbal_json(const Recording& recording) {
  const std::size_t step = std::max<std::size_t>(1, recording.size() / gimbal_points);
  Json time = Json::array();
  Json outer = Json::array();
  Json inner = Json::array();
  for (std::size_t row = 0; row < recording.size(); row += step) {
    time.push_back(rounded(recording.time_s[row]));
    outer.push_back(rounded(recording.gimbal_outer_rad[row] / units::degree));
    inner.push_back(rounded(recording.gimbal_inner_rad[row] / units::degree));
  }
  return {{"time_s", std::move(time)}, {"outer_deg", std::move(outer)}, {"inner_deg", std::move(inner)}};
}

Json allan_json(const Recording& recording) {
  std::vector<double> first_temperature;
  const ImuData data = imu_view(recording, first_temperature);
  Json tau = Json::array();
  std::array<Json, 6> columns;
  columns.fill(Json::array());
  for (const AllanPoint& point : allan_deviation(recording, find_segments(data))) {
    tau.push_back(rounded(point.tau_s));
    for (std::size_t axis = 0; axis < columns.size(); ++axis) {
      const double unit = axis < 3 ? units::degree_per_hour : units::micro_g;
      columns[axis].push_back(rounded(point.deviation[axis] / unit));
    }
  }
  return {{"tau_s", std::move(tau)},
          {"gyro_deg_per_h", {columns[0], columns[1], columns[2]}},
          {"accel_ug", {columns[3], columns[4], columns[5]}}};
}

// JSON inside a <script> element: "</script>" and "<!--" must not appear, and "<" appears in strings only.
std::string script_safe(const Json& document) {
  const std::string text = document.dump();
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace

nlohmann::ordered_json report_document(const CalibrationResult& result, const CalibrationOptions& options,
                                       const Recording& recording, const std::vector<std::string>& warnings) {
  Json document = result_json(result, options, recording, warnings, true);
  round_curves(document);
  document["gimbal"] = gimbal_json(recording);
  document["allan"] = allan_json(recording);
  return document;
}

std::string report_page(const nlohmann::ordered_json& document) {
  std::string page = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                     "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                     "<link rel=\"icon\" href=\"data:,\">\n<title>Self-calibration report</title>\n<style>\n";
  for (const std::string_view style : page_styles()) {
    page += style;
  }
  page += "</style>\n</head>\n<body>\n";
  page += page_body();
  page += "<script type=\"application/json\" id=\"document\">" + script_safe(document) + "</script>\n";
  for (const std::string_view script : page_scripts()) {
    page += "<script>\n";
    page += script;
    page += "\n</script>\n";
  }
  return page + "</body>\n</html>\n";
}

}  // namespace selfcal::report
