#include "tools/cli/poses_attitude_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "estimator/geometry/units.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::ByAttitude;
using diagnosis::PoseParameter;
using Json = nlohmann::ordered_json;

Json array(const Vector3& v) { return Json{v.x(), v.y(), v.z()}; }

Json parameters_json(const std::vector<PoseParameter>& all) {
  Json json = Json::array();
  for (const PoseParameter& p : all) {
    json.push_back(
        {{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"sigma", p.sigma}, {"determined", p.determined}});
  }
  return json;
}

// "x/y/z +0.4/-0.2/+0.1 +- 0.01/0.01/0.02" of the parameters whose names begin so.
std::string in_a_row(const std::vector<PoseParameter>& all, const std::string& stem, double unit, int digits) {
  std::vector<std::string> names, values, sigmas;
  for (const PoseParameter& p : all) {
    if (p.name.starts_with(stem)) {
      names.push_back(p.name.substr(stem.size()));
      values.push_back(fmt::format("{:+.{}f}", p.value / unit, digits));
      sigmas.push_back(fmt::format("{:.2g}", p.sigma / unit));
    }
  }
  return fmt::format("{} {} +- {}", fmt::join(names, "/"), fmt::join(values, "/"), fmt::join(sigmas, "/"));
}

constexpr double percent = 0.01;

std::string three(const Vector3& value, const Vector3& sigma, double unit) {
  return fmt::format("{:+.4g}/{:+.4g}/{:+.4g} +- {:.2g}/{:.2g}/{:.2g}", value.x() / unit, value.y() / unit,
                     value.z() / unit, sigma.x() / unit, sigma.y() / unit, sigma.z() / unit);
}

std::string head_text(const ByAttitude& d) {
  std::string text =
      fmt::format("attitude as {}{}: {} values over {:.0f} s, every {:.4g} ms; noise {:.2g} mrad an axis{}\n",
                  d.reading, d.read_by_data ? ", as the gyros show" : "", d.samples, d.seconds, 1e3 * d.interval_s,
                  1e3 * d.noise_rad, d.noise_time_s > 0.0 ? fmt::format(", lasting {:.2g} s", d.noise_time_s) : "");
  if (!d.read_as_well.empty()) {
    text +=
        fmt::format("  or as well {}: what is told of the sensors is the same\n", fmt::join(d.read_as_well, ", or "));
  }
  if (d.without + d.left_out > 0 || d.held > 0 || d.pieces > 1) {
    text += fmt::format(
        "  left out: {} rows without an attitude, {} that jump, {} stretches ({:.1f} s) where it stands and the "
        "gyros turn; {} piece{}\n",
        d.without, d.left_out, d.held, d.held_s, d.pieces, d.pieces == 1 ? "" : "s");
  }
  if (d.delay_seen) {
    text +=
        fmt::format("  clock: the attitude is {} by {:.3f} +- {:.3f} ms, and its clock {} by {:.1f} +- {:.1f} ppm\n",
                    d.delay_s < 0.0 ? "early" : "late", 1e3 * std::abs(d.delay_s), 1e3 * d.delay_sigma_s,
                    d.drift_ppm < 0.0 ? "slow" : "fast", std::abs(d.drift_ppm), d.drift_sigma_ppm);
  }
  constexpr double seen = 4.0;  // sigma
  if (std::abs(d.smoothing_s2) > seen * d.smoothing_sigma_s2) {
    text += fmt::format("  the {} average over {:.2g} ms more (rms) than the {}\n",
                        d.smoothing_s2 > 0.0 ? "gyros" : "attitude's values",
                        1e3 * std::sqrt(2.0 * std::abs(d.smoothing_s2)),
                        d.smoothing_s2 > 0.0 ? "attitude's values" : "gyros");
  }
  return text;
}

std::string gyros_text(const ByAttitude& d, const ReadingUnits& shown) {
  std::string text;
  constexpr double nominal = 0.5;  // beyond half the gyros' unit is not that which was told
  const double unit = d.raw_per_si;
  if (std::abs(unit - 1.0) > nominal) {
    text += fmt::format("  gyros: {:.6g} raw units per rad/s ({:.6g} per deg/s; --gyro-unit says it)\n", unit,
                        unit * units::degree);
  }
  for (const diagnosis::TurnedAxis& g : d.gains) {
    text += fmt::format("  gyros about ({:+.3f} {:+.3f} {:+.3f}): {:+.4f} +- {:.4f} %\n", g.along.x(), g.along.y(),
                        g.along.z(), 100.0 * (g.gain - 1.0), 100.0 * g.sigma);
  }
  if (!d.gyros.empty()) {
    text += fmt::format("  gyros, scale factors, %: {}\n", in_a_row(d.gyros, "scale_", percent, 4));
    text +=
        fmt::format("  gyros, misalignments{}, %: {}\n", d.by_accelerometers ? " to the accelerometers" : ", symmetric",
                    in_a_row(d.gyros, "misalignment_", percent, 4));
  }
  text += fmt::format("  gyros, mean bias, {}: {}\n", shown.gyro_name, three(d.bias, d.bias_sigma, shown.gyro));
  constexpr double seen = 4.0;  // sigma
  if (d.slope.cwiseQuotient(d.slope_sigma).cwiseAbs().maxCoeff() > seen) {
    text += fmt::format("  gyros, change of the bias, {} per h: {}\n", shown.gyro_name,
                        three(d.slope, d.slope_sigma, shown.gyro / units::hour));
  }
  if (d.walk > 0.0) {
    text += fmt::format("  gyros, random walk of the bias: {:.2g} {} per sqrt(h)\n",
                        d.walk / shown.gyro * std::sqrt(units::hour), shown.gyro_name);
  }
  return text;
}

std::string around_text(const ByAttitude& d, const ReadingUnits& shown) {
  std::string text;
  if (d.gravity) {
    const diagnosis::GravityByAttitude& g = *d.gravity;
    text += fmt::format("  accelerometers in {} rests, {:.3f} mg rms: scale factors, %: {}\n", g.poses,
                        1e3 * g.rms / units::standard_gravity, in_a_row(g.parameters, "scale_", percent, 4));
    text += fmt::format("    misalignments, %: {}; bias, {}: {}\n", in_a_row(g.parameters, "misalignment_", percent, 4),
                        shown.accel_name, in_a_row(g.parameters, "bias_", shown.accel, 3));
    text += fmt::format("  the reference's {} axis leans by {:.3f} +- {:.3f} deg against the vertical\n", g.lean_axis,
                        g.lean_deg, g.lean_sigma_deg);
  }
  const double earth = d.earth.norm();
  const double sigma = std::sqrt(d.earth_sigma.squaredNorm() / 3.0);
  constexpr double seen = 4.0;  // sigma
  if (earth > seen * sigma) {
    text += fmt::format("  the Earth's rate in the reference's frame: {:.2f} +- {:.2f} deg/h (15.04 is right)\n",
                        earth / units::degree_per_hour, sigma / units::degree_per_hour);
  }
  if (!d.gyros.empty()) {
    text +=
        fmt::format("  what is tracked is turned against the sensor by {:.3f} deg\n", d.mount.norm() / units::degree);
  }
  if (d.misfit > 1.0) {
    text +=
        fmt::format("  the noise is not what is assumed of it: sigma is larger by up to {:.2f} therefore\n", d.misfit);
  }
  constexpr double telling = 0.3;  // beyond it the attitude's own noise hides that of the gyros
  if (d.independence.sigma > 0.0 && d.independence.sigma < telling && !d.independence.shown) {
    text += fmt::format(
        "  whether it was computed from these gyros is not shown: of their noise it lacks {:.2f} +- {:.2f}, a "
        "reference all\n",
        d.independence.value, d.independence.sigma);
  }
  return text;
}

}  // namespace

std::string attitude_text(const ByAttitude& d, const ReadingUnits& shown) {
  if (!d.failure.empty()) {
    return fmt::format("attitude: not used: {}\n", d.failure);
  }
  return head_text(d) + gyros_text(d, shown) + around_text(d, shown);
}

nlohmann::ordered_json attitude_json(const ByAttitude& d) {
  if (!d.failure.empty()) {
    return {{"failure", d.failure}};
  }
  Json gains = Json::array();
  for (const diagnosis::TurnedAxis& g : d.gains) {
    gains.push_back({{"along", array(g.along)}, {"gain", g.gain}, {"sigma", g.sigma}});
  }
  Json j = {{"reading", d.reading},
            {"read_by_data", d.read_by_data},
            {"read_as_well", d.read_as_well},
            {"samples", d.samples},
            {"seconds", d.seconds},
            {"interval_s", d.interval_s},
            {"without", d.without},
            {"left_out", d.left_out},
            {"held", d.held},
            {"held_s", d.held_s},
            {"pieces", d.pieces},
            {"turned_deg", array(d.turned_deg)},
            {"axes", d.axes},
            {"gains", gains},
            {"raw_per_rad_s", d.raw_per_si},
            {"frame", d.by_accelerometers ? "accelerometers" : "symmetric"},
            {"gyros", parameters_json(d.gyros)},
            {"gyro_bias", array(d.bias)},
            {"gyro_bias_sigma", array(d.bias_sigma)},
            {"gyro_bias_slope", array(d.slope)},
            {"gyro_bias_slope_sigma", array(d.slope_sigma)},
            {"gyro_bias_walk", d.walk},
            {"gyro_white_noise", d.gyro_asd},
            {"clock",
             {{"seen", d.delay_seen},
              {"delay_s", d.delay_s},
              {"delay_sigma_s", d.delay_sigma_s},
              {"drift_ppm", d.drift_ppm},
              {"drift_sigma_ppm", d.drift_sigma_ppm}}},
            {"smoothing_s2", d.smoothing_s2},
            {"smoothing_sigma_s2", d.smoothing_sigma_s2},
            {"noise_rad", d.noise_rad},
            {"noise_time_s", d.noise_time_s},
            {"earth_rad_s", array(d.earth)},
            {"earth_sigma_rad_s", array(d.earth_sigma)},
            {"misfit", d.misfit},
            {"independence",
             {{"value", d.independence.value}, {"sigma", d.independence.sigma}, {"shown", d.independence.shown}}}};
  if (!d.gyros.empty()) {
    j["mount_rad"] = array(d.mount);
    j["mount_sigma_rad"] = array(d.mount_sigma);
  }
  if (d.gravity) {
    j["gravity"] = {{"poses", d.gravity->poses},       {"accelerometers", parameters_json(d.gravity->parameters)},
                    {"rms_mps2", d.gravity->rms},      {"lean_axis", d.gravity->lean_axis},
                    {"lean_deg", d.gravity->lean_deg}, {"lean_sigma_deg", d.gravity->lean_sigma_deg}};
  }
  return j;
}

}  // namespace selfcal::cli
