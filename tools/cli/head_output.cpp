#include "tools/cli/head_output.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "daemon/estimate/quantity_text.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;
using diagnosis::DividingHead;
using diagnosis::PoseParameter;

struct Shown {
  std::string_view name, label, unit;
  double per_unit;
};
constexpr std::array<Shown, 6> shown{{
    {"bias", "bias K0", "mg", 1e-3},
    {"scale", "scale K1", "%", 1e-2},
    {"k2", "K2, by the square", "ug/g^2", 1e-6},
    {"kip", "Kip, along times across", "ug/g^2", 1e-6},
    {"misalignment", "axis against the scale", "mrad", 1e-3},
    {"", "", "", 1.0},
}};

std::string line(const PoseParameter& p) {
  const Shown* s = shown.data();
  while (!s->name.empty() && s->name != p.name) {
    ++s;
  }
  const bool raw = p.unit == "raw/g";
  const QuantityText text = quantity_text(raw ? p.value : p.value / s->per_unit, raw ? p.sigma : p.sigma / s->per_unit);
  return fmt::format("  {:24} {:>14} +- {:<12} {}\n", s->label, text.value, text.sigma, raw ? "raw a g" : s->unit);
}

double log10_of(double log_p) { return log_p / std::log(10.0); }

}  // namespace

nlohmann::ordered_json head_json(const DividingHead& head) {
  Json parameters = Json::array();
  for (const PoseParameter& p : head.parameters) {
    parameters.push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"sigma", p.sigma}});
  }
  return {{"stops", head.stops},
          {"angles", head.angles},
          {"widest_step_deg", head.step_rad / units::degree},
          {"level_at_deg", head.level_rad / units::degree},
          {"rms_g", head.rms},
          {"parameters", parameters},
          {"third", {{"named", head.third}, {"log10_p", log10_of(head.log_p_third)}}},
          {"drift", {{"named", head.drift}, {"log10_p", log10_of(head.log_p_drift)}}}};
}

std::string head_text(const DividingHead& head) {
  std::string text = fmt::format("dividing head: {} stops at {} angles, what is left {:.3g} ug rms\n", head.stops,
                                 head.angles, 1e6 * head.rms);
  if (head.third) {
    text += fmt::format("misfit: a part of three times the angle (log10 p {:.1f}): cubic, or range\n",
                        log10_of(head.log_p_third));
  }
  if (head.drift) {
    text += fmt::format("named: a drift with the order of the stops (log10 p {:.1f}), taken out\n",
                        log10_of(head.log_p_drift));
  }
  if (!head.third && !head.drift) {
    text += "nothing named beyond bias, scale factor, square and misalignment\n";
  }
  for (const PoseParameter& p : head.parameters) {
    text += line(p);
  }
  return text + fmt::format("the axis is level and rises with the angle at {:.0f} deg of the scale\n",
                            head.level_rad / units::degree);
}

}  // namespace selfcal::cli
