#include "tools/report/calibration_document.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/estimate/calibrate_recording.hpp"
#include "daemon/estimate/result_json.hpp"
#include "estimator/diagnosis/regression/signature_pass.hpp"
#include "estimator/geometry/units.hpp"
#include "tools/report/noise_document.hpp"
#include "tools/report/page.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double innovation_scale = 1000.0;  // plotted to a thousandth of a sigma
constexpr std::size_t gimbal_points = 1500;  // a point a pixel on a wide screen

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

// Innovations of a forward pass at the answer, over their predicted sigma: unit variance where nothing is left out.
Json innovations_json(const CalibrationResult& result, const Recording& recording) {
  std::vector<double> first_temperature;
  const ImuData data = imu_view(recording, first_temperature);
  const diagnosis::RecordingContext context(data);
  PassInput input;
  input.data = &data;
  input.parameters = result.value;
  input.C_nb = result.C_nb_start;
  input.noise = result.noise;
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  const diagnosis::SignatureRows rows = diagnosis::SignaturePass(context, {}, false).run(input);
  Json time = Json::array();
  std::array<Json, 3> axes;
  axes.fill(Json::array());
  for (Eigen::Index row = 0; row + 2 < rows.residual.size(); row += 3) {
    time.push_back(rounded(rows.time_s[static_cast<std::size_t>(row)]));
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      const double value = rows.residual[row + static_cast<Eigen::Index>(axis)];
      axes[axis].push_back(std::round(value * innovation_scale) / innovation_scale);
    }
  }
  return {{"time_s", std::move(time)}, {"north", axes[0]}, {"up", axes[1]}, {"east", axes[2]}};
}

}  // namespace

nlohmann::ordered_json calibration_document(const JudgedResult& judged, const CalibrationOptions& options,
                                            const Recording& recording, const std::vector<std::string>& warnings) {
  Json document = result_json(judged, options, recording, warnings, true);
  document["kind"] = "calibration";
  round_curves(document);
  document["gimbal"] = gimbal_json(recording);
  document["allan"] = noise_document(recording);
  document["innovations"] = innovations_json(judged.result, recording);
  return document;
}

}  // namespace selfcal::report
