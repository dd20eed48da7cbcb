#include "protocol/import/guess_names.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

#include "protocol/import/guess_attitude.hpp"
#include "protocol/import/name_triads.hpp"
#include "protocol/import/name_words.hpp"
#include "protocol/import/text_dialect.hpp"
#include "protocol/import/units.hpp"
#include "protocol/import/word_halves.hpp"

namespace selfcal::import {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Takes a unit off the end of the words: acc x m s2.
std::string unit_at_end(Words& words) {
  struct Ending {
    std::vector<std::string_view> words;
    std::string_view unit;
  };
  static const std::vector<Ending> endings{
      {{"m", "s", "s"}, "m/s^2"},
      {{"m", "s2"}, "m/s^2"},
      {{"mps2"}, "m/s^2"},
      {{"ms2"}, "m/s^2"},
      {{"m", "s"}, "m/s"},
      {{"mps"}, "m/s"},
      {{"rad", "s"}, "rad/s"},
      {{"rads"}, "rad/s"},
      {{"radps"}, "rad/s"},
      {{"deg", "s"}, "deg/s"},
      {{"dps"}, "deg/s"},
      {{"degps"}, "deg/s"},
      {{"mdps"}, "mdeg/s"},
      {{"rpm"}, "rpm"},
      {{"rev", "s"}, "rev/s"},
      {{"gal"}, "cm/s^2"},
      {{"deg", "h"}, "deg/h"},
      {{"dph"}, "deg/h"},
      {{"deg", "hr"}, "deg/h"},
      {{"deg"}, "deg"},
      {{"rad"}, "rad"},
      {{"arcsec"}, "arcsec"},
      {{"mg"}, "mg"},
      {{"ug"}, "ug"},
      {{"mrad", "s"}, "mrad/s"},
      {{"ms"}, "ms"},
      {{"us"}, "us"},
      {{"ns"}, "ns"},
      {{"degc"}, "C"},
      {{"deg", "c"}, "C"},
      {{"kelvin"}, "K"},
      {{"celsius"}, "C"},
      {{"degf"}, "F"},
      {{"g"}, "g"},
      {{"m", "s", "2"}, "m/s^2"},
      {{"deg", "per", "s"}, "deg/s"},
      {{"rad", "per", "s"}, "rad/s"},
      {{"deg", "per", "h"}, "deg/h"},
      {{"deg", "sec"}, "deg/s"},
      {{"rad", "sec"}, "rad/s"},
      {{"deg", "per", "sec"}, "deg/s"},
      {{"rad", "per", "sec"}, "rad/s"},
  };
  for (const Ending& ending : endings) {
    if (words.size() > ending.words.size() &&
        std::equal(ending.words.begin(), ending.words.end(),
                   words.end() - static_cast<std::ptrdiff_t>(ending.words.size()))) {
      words.resize(words.size() - ending.words.size());
      return std::string(ending.unit);
    }
  }
  return {};
}

// The unit of the first pair whose word is among WORDS.
std::string unit_among(const Words& words, std::initializer_list<std::pair<std::string_view, std::string_view>> pairs) {
  for (const auto& [word, unit] : pairs) {
    if (is_one_of(words, {word})) {
      return std::string(unit);
    }
  }
  return {};
}

// The axis at the end, in words or glued to a stem ("gx", "accy", "wz"), taken off.
int take_axis(Words& words) {
  constexpr std::string_view letters = "xyz";
  for (auto word = words.rbegin(); word != words.rend(); ++word) {
    if (word->size() == 1 && letters.find(*word) != std::string_view::npos) {
      const int axis = static_cast<int>(letters.find(*word));
      words.erase(std::next(word).base());
      return axis;
    }
  }
  // "xAccel"
  static constexpr std::string_view behind[] = {"acc", "accel", "acceleration", "gyr", "gyro", "mag", "out"};
  for (std::string& word : words) {
    const std::size_t axis = word.empty() ? std::string_view::npos : letters.find(word.front());
    const std::string_view stem = std::string_view(word).substr(word.empty() ? 0 : 1);
    if (axis != std::string_view::npos && std::find(std::begin(behind), std::end(behind), stem) != std::end(behind)) {
      word.erase(0, 1);
      return static_cast<int>(axis);
    }
  }
  static constexpr std::string_view stems[] = {
      "g",     "w",  "a",  "f",   "ac", "acc", "accel",  "gyr",  "gyro", "gyr0", "dv",    "dth",  "da", "om",
      "omega", "fb", "wb", "wib", "m",  "mag", "dtheta", "dvel", "dang", "fib",  "force", "rate", "v",  "vel"};
  for (std::string& word : words) {
    const std::size_t axis = word.empty() ? std::string_view::npos : letters.find(word.back());
    const std::string_view stem = std::string_view(word).substr(0, word.empty() ? 0 : word.size() - 1);
    if (axis != std::string_view::npos && std::find(std::begin(stems), std::end(stems), stem) != std::end(stems)) {
      word.pop_back();
      return static_cast<int>(axis);
    }
  }
  return -1;
}

// 0, 1 or 2 of a rate of roll, pitch or yaw; -1: none.
int turned_about(const Words& words, const std::string& unit) {
  const auto quantity = find_unit(unit);
  const bool rate = holds(words, {"rate"}) || (quantity && quantity->quantity == Quantity::angular_rate);
  constexpr std::array<std::string_view, 3> names{"roll", "pitch", "yaw"};
  for (std::size_t k = 0; k < names.size() && rate; ++k) {
    if (is_one_of(words, {names[k]}) || is_one_of(words, {std::string(names[k]) + "rate"})) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

Role triad_role(const Words& w) {
  // "Gravity X" of a phone is what its filter makes of all sensors.
  if (holds(w, {"mag", "gravity"}) || is_one_of(w, {"m", "b", "pos", "position", "lat", "lon", "alt", "quat", "q"})) {
    return Role::other;
  }
  // What a device takes its bias for is no reading.
  if (is_one_of(w, {"bias"})) {
    return Role::other;
  }
  // Betaflight's controllers, axisF[0]; what a body or a table is told to do.
  if ((is_one_of(w, {"axis"}) && is_one_of(w, {"p", "i", "d", "f", "s"})) ||
      is_one_of(w, {"cmd", "command", "setpoint", "table", "turntable"})) {
    return Role::other;
  }
  // What readings scatter by is no reading.
  if (holds(w, {"std", "stdev", "sigma", "deviation", "variance"}) || is_one_of(w, {"sd", "rms", "var"})) {
    return Role::other;
  }
  const bool inc = holds(w, {"delta", "incr"}) || is_one_of(w, {"inc", "d"});
  // "gFx" of a phone's G-force meter.
  if (is_one_of(w, {"g"}) && is_one_of(w, {"f"})) {
    return Role::accelerometer;
  }
  const bool turned =
      holds(w, {"gyr", "pqr", "omega", "angular", "angrate", "turnrate", "dtheta", "dang", "drehrate", "rotation"}) ||
      (inc && (holds(w, {"theta", "angle"}) || is_one_of(w, {"ang"}))) ||
      (holds(w, {"ang"}) && holds(w, {"rate", "vel"}));
  const bool pushed = holds(w, {"acc", "force", "beschl"});  // "accel_g_x": its g is a unit
  if (turned || (!pushed && is_one_of(w, {"g", "gy", "w", "wb", "wib", "om", "rate", "rot", "dth", "da"}))) {
    return Role::gyro;
  }
  if (pushed || is_one_of(w, {"a", "ac", "f", "fb", "fib", "dv", "dvel"}) ||
      (inc && (holds(w, {"vel"}) || is_one_of(w, {"v"})))) {
    return Role::accelerometer;
  }
  // "field.angular_velocity.x" is what ROS calls a field.
  return holds(w, {"field"}) ? Role::other : Role::unknown;
}

Role single_role(const Words& w) {
  if (holds(w, {"temp"}) || is_one_of(w, {"tmp"})) {
    return Role::temperature;
  }
  if (holds(w, {"outer"})) {
    return Role::outer;
  }
  if (holds(w, {"inner"})) {
    return Role::inner;
  }
  // Betaflight's controllers: axisP[0].
  if (is_one_of(w, {"axis"}) && is_one_of(w, {"p", "i", "d", "f"})) {
    return Role::other;
  }
  if (holds(w, {"gimbal", "turntable", "encoder", "resolver", "cmd", "axis"})) {
    return Role::gimbal;
  }
  if (holds(w, {"time", "stamp", "zeit", "utc", "date", "epoch", "elapsed"}) ||
      is_one_of(w, {"t", "ts", "sec", "seconds", "millis", "micros", "tow", "sow", "s", "ms", "us", "ns"})) {
    return Role::time;
  }
  if (holds(w, {"count", "index", "seq", "sample", "packet", "frame"}) ||
      is_one_of(w, {"n", "i", "id", "nr", "no", "cnt", "counter", "idx"})) {
    return Role::counter;
  }
  // Known, and of no use here.
  if (holds(w, {"lat", "lon", "alt", "height", "press", "baro", "volt", "status", "flag", "mode", "sat", "vel", "quat",
                "speed"})) {
    return Role::other;
  }
  return Role::unknown;
}

// Takes "[0]", "[1]" or "[2]" off the end: one of three.
int take_index(std::string_view& name) {
  constexpr std::size_t length = 3;
  const std::string_view text = trimmed(name);
  if (text.size() <= length || text.back() != ']' || text[text.size() - length] != '[') {
    return -1;
  }
  const int index = text[text.size() - 2] - '0';
  if (index < 0 || index > 2) {
    return -1;
  }
  name = text.substr(0, text.size() - length);
  return index;
}

void add_role_by_unit(NamedColumn& column) {
  const auto unit = find_unit(column.unit);
  if (!unit) {
    return;
  }
  const bool unsaid = column.role == Role::unknown;
  if (column.axis < 0 && unit->quantity == Quantity::time && (unsaid || column.role == Role::temperature)) {
    column.role = Role::time;
  } else if (column.axis >= 0 && unsaid && unit->quantity == Quantity::time) {
    column.axis = -1;  // "X[s]" beside each channel
    column.role = Role::time;
  } else if (column.axis >= 0 && unsaid && unit->quantity == Quantity::angular_rate) {
    column.role = Role::gyro;
  } else if (column.axis >= 0 && unsaid && unit->quantity == Quantity::acceleration) {
    column.role = Role::accelerometer;
  }
}

// "0.1 ms", "1/32768 s", "in/s^2": written as a unit is. A field's number ("x8004") is none.
bool written_as_unit(std::string_view written) {
  const bool amount =
      !written.empty() && is_digit(written.front()) && !std::all_of(written.begin(), written.end(), is_digit);
  return amount || written.find_first_of("/*") != std::string_view::npos;
}

// Of a time: a length of its own, which the numbers do not tell. Other words in brackets are none: "(UTC)".
bool counts_its_own(std::string_view written) {
  return written_as_unit(written) || holds(words_of(written), {"tick", "cycle", "clock", "clk", "count"});
}

NamedColumn read_plain_name(std::string_view name, std::string_view unit) {
  NamedColumn column;
  if (trimmed(name).empty()) {
    column.unit = known_unit(unit);
    return column;
  }
  std::string_view bare = name;
  int index = take_index(bare);
  if (const std::size_t unit_at = bare.rfind('('); index < 0 && unit_at != std::string_view::npos) {
    std::string_view head = bare.substr(0, unit_at);  // "gyroADC[0] (deg/s)"
    index = take_index(head);
    if (index >= 0) {
      column.unit = known_unit(bare.substr(unit_at + 1, bare.find(')', unit_at) - unit_at - 1));
      bare = head;
    }
  }
  // "IMU_ATTI(0):accelX": what stands in brackets within a name is no unit.
  std::string without;
  if (const std::size_t open = bare.find('('), close = bare.find(')');
      close != std::string_view::npos && open < close && !trimmed(bare.substr(close + 1)).empty() &&
      known_unit(bare.substr(open + 1, close - open - 1)).empty()) {
    without = std::string(bare.substr(0, open)) + " " + std::string(bare.substr(close + 1));
    bare = without;
  }
  std::string_view written;  // a unit in brackets
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}, std::pair{'{', '}'}}) {
    const std::size_t begin = bare.find(open);
    const std::size_t end = begin == std::string_view::npos ? begin : bare.find(close, begin);
    if (end != std::string_view::npos && begin > 0) {
      written = bare.substr(begin + 1, end - begin - 1);
      column.unit = known_unit(written);
      bare = bare.substr(0, begin);
      break;
    }
  }
  Words words = words_of(bare);
  if (column.unit.empty() && !unit.empty()) {
    column.unit = known_unit(unit);
  }
  const std::string ending = unit_at_end(words);
  column.unit = column.unit.empty() ? ending : column.unit;
  const bool delta =
      holds(words, {"delta", "incr", "dtheta", "dvel", "dang"}) || is_one_of(words, {"inc", "d", "dv", "dth", "da"});
  Words stems = words;
  column.axis = index >= 0 ? index : take_axis(stems);
  // "Yaw Rate [deg/s]": about x, y, z of the body.
  if (const int about = turned_about(words, column.unit); column.axis < 0 && about >= 0) {
    column.axis = about;
    column.role = Role::gyro;
    return column;
  }
  // "gyro_dps_x", "accel_mg_y": the unit before the axis.
  if (column.axis >= 0 && column.unit.empty() && holds(stems, {"gyr", "acc"})) {
    const std::string inner = unit_at_end(stems);
    const auto known = find_unit(inner);
    const bool fits =
        known && known->quantity == (holds(stems, {"gyr"}) ? Quantity::angular_rate : Quantity::acceleration);
    column.unit = fits ? inner : std::string();
  }
  column.increment = delta || (column.axis >= 0 && is_one_of(stems, {"dv", "dth", "da", "dtheta", "dvel", "dang"}));
  column.role = column.axis >= 0 ? triad_role(stems) : single_role(words);
  // "Gyro X temp", "axisP[0]"
  if (column.axis >= 0 && (holds(words, {"temp"}) || (index >= 0 && column.role == Role::unknown))) {
    column.axis = -1;
    column.role = single_role(words);
  }
  // LabVIEW's measurement files.
  if (bare == "X_Value") {
    column.axis = -1;
    column.role = Role::time;
  }
  // "T_C", "T_chamber_C", "T [K]": a t with a unit of temperature is no time.
  const bool thermal = column.unit.empty() ? words.size() > 1 && is_one_of(Words{words.back()}, {"c", "k", "f"})
                                           : column.unit == "C" || column.unit == "K" || column.unit == "F";
  if (column.role == Role::time && thermal && is_one_of(words, {"t"})) {
    column.role = Role::temperature;
  }
  // "Temps (s)", "Tid [ms]", "Vitesse angulaire X (°/s)": a language that nobody thought of, and a unit that says what it is.
  add_role_by_unit(column);
  // "axis1_rate_dps": how fast a table turns is no read-out of where it stands.
  const auto unit_said = find_unit(column.unit);
  const bool turns = unit_said && unit_said->quantity == Quantity::angular_rate;
  if (turns && (column.role == Role::outer || column.role == Role::inner || column.role == Role::gimbal)) {
    column.role = Role::other;
  }
  if (column.role == Role::temperature && column.unit.empty()) {
    column.unit = unit_among(words, {{"c", "C"}, {"k", "K"}, {"f", "F"}});
  }
  if (column.role == Role::time && column.unit.empty()) {
    column.unit =
        unit_among(words, {{"ms", "ms"},      {"us", "us"},       {"ns", "ns"},     {"millis", "ms"}, {"micros", "us"},
                           {"s", "s"},        {"sec", "s"},       {"seconds", "s"}, {"h", "h"},       {"hr", "h"},
                           {"hrs", "h"},      {"hour", "h"},      {"hours", "h"},   {"min", "min"},   {"mins", "min"},
                           {"minute", "min"}, {"minutes", "min"}, {"datenum", "d"}, {"days", "d"},    {"tow", "s"},
                           {"sow", "s"}});
    const std::string_view said = written.empty() ? unit : written;
    column.other_unit = !column.unit.empty()     ? std::string()
                        : counts_its_own(said)   ? std::string(said)
                        : holds(words, {"tick"}) ? "ticks"
                                                 : std::string();
  }
  const bool of_triad = column.role == Role::gyro || column.role == Role::accelerometer;
  if (of_triad && column.unit.empty() && written_as_unit(written)) {
    column.other_unit = std::string(written);
  }
  return column;
}

}  // namespace

NamedColumn read_name(std::string_view name, std::string_view unit) {
  if (name.ends_with(low_half)) {
    NamedColumn column;
    column.role = Role::other;
    return column;
  }
  // "/robot/imu.angular_velocity.x": the field of a ROS message; the topic is somebody's choice, and is asked last.
  const std::size_t field = name.starts_with('/') ? name.find('.') : std::string_view::npos;
  if (field == std::string_view::npos) {
    return read_plain_name(name, unit);
  }
  const NamedColumn column = read_plain_name(name.substr(field + 1), unit);
  return column.role == Role::unknown ? read_plain_name(name, unit) : column;
}

std::vector<NamedColumn> read_names(const std::vector<std::string>& names, const std::vector<std::string>& units) {
  std::vector<NamedColumn> all;
  all.reserve(names.size());
  for (std::size_t k = 0; k < names.size(); ++k) {
    all.push_back(read_name(names[k], k < units.size() ? std::string_view(units[k]) : std::string_view{}));
  }
  leave_out_linear(names, all);
  read_body_rates(names, all);
  read_directions(names, all, Role::gyro);
  read_directions(names, all, Role::accelerometer);
  // "rotation.x" beside "rotation.w" is no rate.
  for (const AttitudeColumns& attitude : attitudes_by_name(names, units)) {
    for (const std::size_t column : attitude.columns) {
      all[column].role = attitude.form == AttitudeForm::angles ? all[column].role : Role::other;
    }
  }
  return all;
}

}  // namespace selfcal::import
