#include "tools/cli/poses_output.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"
#include "tools/cli/head_output.hpp"
#include "tools/cli/poses_attitude_output.hpp"
#include "tools/cli/poses_words.hpp"
#include "tools/cli/rest_output.hpp"

namespace selfcal::cli {
namespace {

std::string three(const std::array<double, 3>& v, double unit) {
  return fmt::format("{:.4g}/{:.4g}/{:.4g}", v[0] / unit, v[1] / unit, v[2] / unit);
}

std::string clipping_text(const diagnosis::PoseDiagnosis& d, const ReadingUnits& shown) {
  std::string text;
  for (const diagnosis::LeftOut& out : d.left_out) {
    text += fmt::format("left out: {:.2f} to {:.2f} s, {} sample{}: {}\n", out.first_s, out.last_s, out.samples,
                        out.samples == 1 ? "" : "s", out.words);
  }
  for (const diagnosis::Clipping& c : d.clipped) {
    text += fmt::format("clipped: {} {} stands at its limit of {:.4g} {} in {} samples, {:.1f} to {:.1f} s\n",
                        c.gyro ? "gyro" : "accelerometer", "xyz"[c.axis], c.limit / (c.gyro ? shown.gyro : shown.accel),
                        c.gyro ? shown.gyro_name : shown.accel_name, c.samples, c.first_s, c.last_s);
  }
  if (std::any_of(d.clipped.begin(), d.clipped.end(), [](const diagnosis::Clipping& c) { return c.gyro; })) {
    text += fmt::format("no orientation is carried through clipped samples: {} turn{} between poses left out\n",
                        d.turns_clipped, d.turns_clipped == 1 ? "" : "s");
  }
  return text;
}

// Parameters that the poses determine, and the names of those that they do not.
std::string parameters_text(const std::vector<diagnosis::PoseParameter>& parameters, const ReadingUnits& shown,
                            bool gyro) {
  std::string text, open;
  for (const diagnosis::PoseParameter& p : parameters) {
    if (!p.determined) {
      open += open.empty() ? "" : ", ";
      open += p.name;
    } else if (p.unit == "1") {
      text += fmt::format("    {:16} {:+9.4f} +- {:.4f} %\n", p.name, 100.0 * p.value, 100.0 * p.sigma);
    } else if (gyro) {
      text += fmt::format("    {:16} {:9.6g} +- {:.2g} {}\n", p.name, p.value, p.sigma, p.unit);
    } else {
      const double unit = shown.accel;
      text +=
          fmt::format("    {:16} {:+9.4g} +- {:.2g} {}\n", p.name, p.value / unit, p.sigma / unit, shown.accel_name);
    }
  }
  if (!open.empty()) {
    text += fmt::format("    not determined by these poses: {}\n", open);
  }
  return text;
}

std::string accelerometers_text(const diagnosis::PoseDiagnosis& d, const ReadingUnits& shown) {
  std::string text = fmt::format("accelerometers: {}; |f| - g {:.3f} mg rms",
                                 !d.accel_adequate ? "misfit"
                                 : d.accel_tested  ? "adequate"
                                                   : "not tested beyond bias, scale and misalignment",
                                 1e3 * d.accel_rms_g);
  if (d.accel_tested) {
    text += fmt::format(", held out {:.3f} mg", 1e3 * d.accel_held_out_rms_g);
  }
  if (!d.accel_tried.empty()) {
    text += fmt::format("; nearest to an effect: {} (log10 p {:.1f})", d.accel_tried.front().effect->id,
                        d.accel_tried.front().log_p / std::log(10.0));
  }
  text += d.force_at_rest_g > 0.0 ? fmt::format("; at rest they read {:.4f} g\n", d.force_at_rest_g) : "\n";
  text += parameters_text(d.accel_parameters, shown, false);
  for (const diagnosis::PoseEffect& e : d.accel_named) {
    text += fmt::format("  {} named, taken out above: log10 p {:.1f}\n", e.effect->id, e.log_p / std::log(10.0));
    for (std::size_t k = 0; k < e.value.size(); ++k) {
      const diagnosis::EffectParameter& p = e.effect->parameters[k];
      text += fmt::format("    {:16} {:+9.4g} +- {:.2g} {}\n", p.name, e.value[k] / p.si_per_unit,
                          e.sigma[k] / p.si_per_unit, p.unit);
    }
  }
  if (d.settling) {
    const diagnosis::Settling& s = *d.settling;
    text += fmt::format("  accel_relaxation: settling after each turn, {}exp(-s/{:.0f} s), log10 p {:.1f}\n",
                        s.with_change ? "change of force times " : "", s.tau_s, s.log_p / std::log(10.0));
    for (int axis = 0; axis < 3; ++axis) {
      text += fmt::format("    {:16} {:+9.1f} +- {:.1f} ug{}\n", "xyz"[axis], 1e6 * s.size_g(axis),
                          1e6 * s.sigma_g(axis), s.with_change ? "/g" : "");
    }
  }
  return text;
}

std::string effect_text(const diagnosis::PoseEffect& e, const ReadingUnits& shown) {
  std::string text;
  for (std::size_t k = 0; k < e.value.size(); ++k) {
    text +=
        fmt::format("    {:4} {:+9.3g} +- {:.2g}\n", e.parameters[k], e.value[k] / shown.gyro, e.sigma[k] / shown.gyro);
  }
  return text;
}

std::string confounded_text(const diagnosis::PoseDiagnosis& d) {
  std::string text;
  for (const diagnosis::Confounded& c : d.confounded) {
    text += fmt::format("{}{} ({:.0f} %) with {}", text.empty() ? "confounded: " : ", ", c.effect->id, 100.0 * c.shared,
                        c.with->id);
  }
  return text.empty() ? text
                      : text + ": the order of the poses is that of time; the same poses in another order tell\n";
}

std::string gyros_text(const diagnosis::PoseDiagnosis& d, const ReadingUnits& shown) {
  std::string text =
      fmt::format("gyros in the poses, {}: bias {} +- {}{}\n", shown.gyro_name, three(d.gyro_bias, shown.gyro),
                  three(d.gyro_bias_sigma, shown.gyro), d.earth_taken_out ? ", the Earth's rate taken out" : "");
  if (d.accel_reversed) {
    text += "  the Earth's rate shows all accelerometers reversed: they read acceleration, no specific force\n";
  }
  text += fmt::format("  rms, poses left out in turn: bias alone {} (white noise {})\n",
                      three(d.gyro_held_out_rms, shown.gyro), three(d.gyro_white_rms, shown.gyro));
  for (const diagnosis::PoseEffect& e : d.gyro_tried) {
    text += fmt::format("  with {:28} {}  log10 p {:.1f}\n", e.effect->id, three(e.held_out_rms, shown.gyro),
                        e.log_p / std::log(10.0));
  }
  text += d.gyro_named.empty() ? "nothing named\n" : "named:\n";
  for (const diagnosis::PoseEffect& e : d.gyro_named) {
    text += fmt::format("  {}{}{}{}{} leaves {}\n", e.may_be_flicker ? "a drift, as by " : "", e.effect->id,
                        e.effect->temperature == diagnosis::TemperatureUse::measured ? ", per degC" : "",
                        e.equivalent.empty() ? "" : ", or as well ", fmt::join(diagnosis::ids_of(e.equivalent), ", "),
                        three(e.held_out_rms, shown.gyro));
    text += effect_text(e, shown);
    if (!std::isnan(e.constant)) {
      text += fmt::format("    {:4} {:9.3g} {}\n", e.effect->constant.name, e.constant, e.effect->constant.unit);
    }
    if (e.may_be_flicker) {
      text +=
          "    or a bias that wanders by itself: beside 1/f noise as large as the halves of the poses differ by it is "
          "not seen;\n"
          "    the same poses once more, just switched on, would tell\n";
    }
    if (e.may_be_earth) {
      text +=
          "    or the Earth's rate, which is not taken out: no latitude, no heading through all turns, or not seen\n";
    }
    if (!e.equivalent.empty()) {
      text += "    these poses do not tell them apart; the same poses once more in another order do\n";
    }
  }
  constexpr double narrow = 20.0;  // deg: no pose effect is seen then, and a bound says nothing
  for (const diagnosis::PoseEffect& e : d.gyro_open) {
    if (e.effect->linear_in_force && d.gravity_span_deg < narrow) {
      continue;
    }
    double largest = 0.0;
    for (std::size_t k = 0; k < e.value.size(); ++k) {
      largest = std::max(largest, std::abs(e.value[k]) + 2.0 * e.sigma[k]);
    }
    text += fmt::format("not seen: {}: coefficients below {:.2g} {} (2 sigma)\n", e.effect->id, largest / shown.gyro,
                        shown.gyro_name);
  }
  text += confounded_text(d);
  return text;
}

std::string turns_text(const diagnosis::PoseDiagnosis& d, const ReadingUnits& shown) {
  if (d.turns == 0) {
    return "no turn between poses is usable: scale factors and misalignment of the gyros are not seen\n";
  }
  std::string text = fmt::format(
      "direction of gravity carried from pose to pose, {} turns: {:.2f} deg rms -> {:.2f}; held out {:.2f} -> {:.2f}\n",
      d.turns, d.direction_before / units::degree, d.direction_after / units::degree,
      d.direction_before_held_out / units::degree, d.direction_after_held_out / units::degree);
  text += parameters_text(d.gyro_parameters, shown, true);
  return text;
}

std::string axis_text(const diagnosis::ReadOutAxis& a) {
  const Eigen::Index k = main_axis(a);
  const double gain = std::abs(a.response(k));
  constexpr double any_gain = 2.0;  // beyond it the gyros' unit is not that which was told
  if (gain > any_gain || gain < 1.0 / any_gain) {
    return fmt::format(
        "  {} axis, {} {}: gyro {}{} {:.6g} +- {:.2g} raw units per rad/s ({:.6g} per deg/s; --gyro-unit says it)\n",
        a.name, a.rows,
        a.steady       ? "steady rates"
        : a.oscillates ? "reversals"
                       : "turns",
        a.response(k) < 0.0 ? "-" : "", "xyz"[k], gain, a.sigma(k), gain * units::degree);
  }
  std::string text = fmt::format(
      "  {} axis, {} {}{}: gyro {}{} {:+.2f} +- {:.2f} %", a.name, a.rows,
      a.steady       ? "steady rates"
      : a.oscillates ? "reversals"
                     : "turns",
      a.steady ? fmt::format(" of {:.0f} to {:.0f} deg/s", a.slowest_deg_per_s, a.fastest_deg_per_s)
               : fmt::format(", {:.0f} deg in all", a.turned_deg),
      a.response(k) < 0.0 ? "-" : "", "xyz"[k], 100.0 * (std::abs(a.response(k)) - 1.0), 100.0 * a.sigma(k));
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (i != k) {
      text += fmt::format(", {} {:+.2f} +- {:.2f} %", "xyz"[i], 100.0 * across(a)(i), 100.0 * a.sigma(i));
    }
  }
  text += " of the turn\n";
  if (a.turns_alike > 0.0) {
    text += "    " + turns_alike_words(a) + "\n";
  }
  if (a.nonlinearity) {
    text += fmt::format("    gyro_scale_nonlinearity {}: {:+.2g} +- {:.2g} % at {:.0f} deg/s\n",
                        a.nonlinearity->determined ? "named" : "not seen",
                        100.0 * a.nonlinearity->value * a.fastest_deg_per_s * units::degree,
                        100.0 * a.nonlinearity->sigma * a.fastest_deg_per_s * units::degree, a.fastest_deg_per_s);
  }
  return text;
}

std::string read_outs_text(const diagnosis::ReadOuts& r, const ReadingUnits& shown) {
  std::string text = "angle read-outs:\n";
  for (const diagnosis::ReadOutAxis& a : r.axes) {
    text += axis_text(a);
  }
  if (std::any_of(r.axes.begin(), r.axes.end(),
                  [](const diagnosis::ReadOutAxis& a) { return a.steady || a.oscillates; })) {
    const Vector3 bias = r.gyro_bias / shown.gyro, sigma = r.gyro_bias_sigma / shown.gyro;
    text += fmt::format("  bias beside the rates {:.3g}/{:.3g}/{:.3g} +- {:.2g}/{:.2g}/{:.2g} {}\n", bias.x(), bias.y(),
                        bias.z(), sigma.x(), sigma.y(), sigma.z(), shown.gyro_name);
  }
  if (r.clock) {
    text += fmt::format(
        "  clock: the read-outs are {} by {:.3f} +- {:.3f} s at mid-recording, {:+.3f} +- {:.3f} s more over it; "
        "single turns {:+.2f} to {:+.2f} s, scatter {:.3f} s\n",
        r.clock->delay_s < 0.0 ? "early" : "late", std::abs(r.clock->delay_s), r.clock->delay_sigma_s,
        r.clock->growth_s, r.clock->growth_sigma_s, r.clock->least_s, r.clock->most_s, r.clock->scatter_s);
  }
  if (r.tilt) {
    text += fmt::format("  accelerometers about the {} axis: what varies with twice its angle: log10 p {:.1f}\n",
                        r.tilt->axis, r.tilt->log_p_shape / std::log(10.0));
  }
  if (r.tilt && r.tilt->near_vertical) {
    text += fmt::format("  {} axis leans by {:.3f} +- {:.3f} deg against the vertical, by the accelerometers\n",
                        r.tilt->axis, r.tilt->tilt_deg, r.tilt->sigma_deg);
  } else if (r.tilt) {
    text += fmt::format("  {} axis lies near the horizontal: its tilt and a bias along it look alike\n", r.tilt->axis);
  }
  if (r.disagreeing > 0) {
    text += fmt::format("  {} turn{} that gyros and read-outs disagree about left out\n", r.disagreeing,
                        r.disagreeing == 1 ? "" : "s");
  }
  return text;
}

std::string noise_text(const std::vector<diagnosis::RestNoise>& all, const char* triad, double unit, const char* name) {
  std::string text;
  for (const diagnosis::RestNoise& n : all) {
    text += fmt::format("  {:6.4g} s  {} {}, +- {:.0f} %\n", n.tau_s, three(n.deviation, unit), name,
                        100.0 / std::sqrt(2.0 * n.freedom));
  }
  return text.empty() ? text : fmt::format("Allan deviation of the {} at rest, x/y/z:\n{}", triad, text);
}

// Of a log with one triad: what both together would say is left out.
std::string one_triad_text(const diagnosis::PoseDiagnosis& d, const ReadingUnits& shown) {
  if (d.sensors == diagnosis::Sensors::accelerometers) {
    return (d.by_poses ? accelerometers_text(d, shown) : std::string()) +
           noise_text(d.accel_noise, "accelerometers", shown.accel, shown.accel_name);
  }
  std::string text;
  if (d.poses > 0) {
    text += fmt::format("gyros at rest, {}: mean {} +- {} by what {} stand{} scatter\n", shown.gyro_name,
                        three(d.gyro_bias, shown.gyro), three(d.gyro_bias_sigma, shown.gyro), d.poses,
                        d.poses == 1 ? "" : "s");
  }
  return text + noise_text(d.gyro_noise, "gyros", shown.gyro, shown.gyro_name);
}

}  // namespace

std::string poses_details(const diagnosis::PoseDiagnosis& d, bool si) {
  const ReadingUnits shown = units_of(si);
  if (d.dividing_head) {
    std::string text = head_text(*d.dividing_head);
    for (const std::string& words : d.invisible) {
      text += fmt::format("invisible: {}\n", words);
    }
    return text;
  }
  std::string text =
      fmt::format("{} static pose{}, {:.0f} s in all\n", d.poses, d.poses == 1 ? "" : "s", d.static_seconds);
  for (const std::string& words : d.supports) {
    text += fmt::format("reference: {}\n", words);
  }
  text += clipping_text(d, shown);
  if (d.read_outs) {
    text += read_outs_text(*d.read_outs, shown);
  }
  if (d.by_attitude) {
    text += attitude_text(*d.by_attitude, shown);
  }
  if (d.rest) {
    text += d.force_at_rest_g > 0.0 ? fmt::format("|f| {:.5f} g; ", d.force_at_rest_g) : std::string();
    text += rest_text(*d.rest);
    if (d.earth_taken_out) {
      text += fmt::format("gyro bias by {} headings, the Earth's rate taken out, {}: {} +- {}\n", d.poses,
                          shown.gyro_name, three(d.gyro_bias, shown.gyro), three(d.gyro_bias_sigma, shown.gyro));
    }
  }
  if (d.sensors != diagnosis::Sensors::both) {
    text += one_triad_text(d, shown);
  } else if (d.by_poses) {
    text += accelerometers_text(d, shown);
    text += gyros_text(d, shown);
    text += turns_text(d, shown);
  }
  if (!d.not_by_position.empty()) {
    text += fmt::format("invisible: the 24 parameters by the position at rest: {}\n", d.not_by_position);
  }
  for (const std::string& words : d.invisible) {
    text += fmt::format("invisible: {}\n", words);
  }
  return text;
}

}  // namespace selfcal::cli
