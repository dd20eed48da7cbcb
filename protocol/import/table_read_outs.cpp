#include "protocol/import/table_read_outs.hpp"

#include "protocol/import/name_words.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

bool says_table(const Words& words) {
  return is_one_of(words, {"table",     "turntable", "ratetable", "encoder", "enc",       "resolver", "gimbal",
                           "axis",      "axis1",     "axis2",     "stage",   "spindle",   "rotary",   "motor",
                           "servo",     "platform",  "trunnion",  "outer",   "inner",     "cmd",      "command",
                           "commanded", "setpoint",  "target",    "applied", "reference", "ref",      "drehtisch"});
}

// Of a quantity that no unit names: "sample_rate", "motor_power" and counts of an encoder are no angle.
bool says_another(const Words& words) {
  return holds(words, {"sample", "count", "tick", "accel", "force", "torque", "volt", "curr", "power", "temp", "thr",
                       "time", "stamp", "status", "state", "flag", "err", "pwm"});
}

bool says_rate(const Words& words) {
  return holds(words, {"rate", "speed", "velocity", "omega"}) || is_one_of(words, {"vel"});
}

bool says_angle(const Words& words) {
  return holds(words, {"angle", "winkel", "theta", "tilt", "yaw", "pitch", "roll", "azimuth", "elevation", "pos"}) ||
         is_one_of(words, {"az", "el", "deg", "rad", "outer", "inner"});
}

}  // namespace

TableReadOut table_read_out(const NamedColumn& column, const std::string& name) {
  const Words words = words_of(name);
  if (!says_table(words) || says_another(words)) {
    return TableReadOut::none;
  }
  if (const auto unit = find_unit(column.unit)) {
    return unit->quantity == Quantity::angle          ? TableReadOut::angle
           : unit->quantity == Quantity::angular_rate ? TableReadOut::rate
                                                      : TableReadOut::none;
  }
  return says_rate(words) ? TableReadOut::rate : says_angle(words) ? TableReadOut::angle : TableReadOut::none;
}

std::vector<double> angle_of_rate(const std::vector<double>& rate, const std::vector<double>& time_s) {
  std::vector<double> angle(rate.size(), 0.0);
  for (std::size_t k = 1; k < rate.size(); ++k) {
    angle[k] = angle[k - 1] + 0.5 * (rate[k] + rate[k - 1]) * (time_s[k] - time_s[k - 1]);
  }
  return angle;
}

}  // namespace selfcal::import
