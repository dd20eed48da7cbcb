#include "protocol/import/guess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "protocol/import/full_words.hpp"
#include "protocol/import/guess_orientation.hpp"
#include "protocol/import/guess_roles.hpp"
#include "protocol/import/guess_table.hpp"
#include "protocol/import/guess_time_axis.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/name_triads.hpp"
#include "protocol/import/psins.hpp"
#include "protocol/import/table_read_outs.hpp"
#include "protocol/import/time_steps.hpp"

namespace selfcal::import {
namespace {

constexpr std::size_t most_numbers = std::size_t{40} << 20;  // judged by; 320 MiB
constexpr std::size_t fewest_columns = 6;

class Guesser {
 public:
  Guesser(const ColumnSource& source, const GuessKnowledge& knowledge, Values values, LeftOutRows lost)
      : source_(source),
        known_(knowledge),
        values_(std::move(values)),
        lost_(std::move(lost)),
        named_(read_names(source.names(), source.units())) {}

  Guess guess() {
    if (source_.dialect() != nullptr) {
      guess_.map.dialect = *source_.dialect();
    }
    psins_ = read_psins(source_.preamble());
    if (std::string words = continue_full_columns(source_, named_, values_); !words.empty()) {
      say("columns", std::move(words));
    }
    roles_ = assign_roles(source_, named_, values_, lost_.rows, psins_.has_value(), known_.sample_rate_hz.has_value(),
                          guess_.remarks);
    guess_site();
    guess_time();
    guess_incomplete();
    if (roles_.gyro && roles_.accelerometer) {
      guess_sensors();
    }
    guess_temperature();
    for (const Remark& remark : guess_.remarks) {
      std::vector<std::string>& unsettled = guess_.map.unsettled;
      if (remark.doubt && std::find(unsettled.begin(), unsettled.end(), remark.key) == unsettled.end()) {
        unsettled.push_back(remark.key);
      }
    }
    return std::move(guess_);
  }

 private:
  void say(const char* key, std::string text) { guess_.remarks.push_back({key, std::move(text), false}); }
  void doubt(const char* key, std::string text) { guess_.remarks.push_back({key, std::move(text), true}); }

  // Whether a key of TABLE is doubted.
  bool is_doubted(std::string_view table) const {
    return std::any_of(guess_.remarks.begin(), guess_.remarks.end(),
                       [table](const Remark& remark) { return remark.doubt && remark.key.starts_with(table); });
  }

  ColumnRef reference(std::size_t column) const {
    const std::vector<std::string>& names = source_.names();
    const std::string& name = names[column];
    const bool unique = !name.empty() && std::count(names.begin(), names.end(), name) == 1;
    return unique ? ColumnRef{0, name} : ColumnRef{column + 1, {}};
  }

  void guess_site() {
    ImportMap& map = guess_.map;
    map.latitude_deg = known_.latitude_deg;
    map.longitude_deg = known_.longitude_deg;
    map.height_m = known_.height_m;
    if (psins_ && !known_.latitude_deg && !known_.longitude_deg && !known_.height_m) {
      map.latitude_deg = psins_->latitude_deg;
      map.longitude_deg = psins_->longitude_deg;
      map.height_m = psins_->height_m;
      return say("site", "from the file's header");
    }
    if (!map.latitude_deg || !map.longitude_deg || !map.height_m) {
      doubt("site", "latitude, longitude and height are not in the file");
    }
  }

  void guess_time() {
    const std::optional<double> of_header =
        psins_ ? std::optional<double>(1.0 / psins_->interval_s) : std::optional<double>();
    TimeGuess time = guess_time_axis(source_, roles_, named_, of_header, known_.sample_rate_hz);
    if (roles_.time) {
      time.map.column = reference(*roles_.time);
    }
    guess_.map.time = std::move(time.map);
    guess_.map.sample_rate_hz = time.sample_rate_hz;
    interval_s_ = time.interval_s;
    std::move(time.remarks.begin(), time.remarks.end(), std::back_inserter(guess_.remarks));
  }

  void guess_incomplete() {
    if (lost_.repeated > 0 && roles_.time) {
      say("time", fmt::format("{} of {} lines are the line before once more: each is taken once", lost_.repeated,
                              lost_.rows.size()));
    }
    if (lost_.incomplete == 0) {
      return;
    }
    const std::string lines = fmt::format("{} of {} lines lack a number", lost_.incomplete, lost_.rows.size());
    if (!roles_.time) {
      return doubt("time", lines + ", and no time says how long they were");
    }
    guess_.map.time.leave_out_incomplete = true;
    say("time.leave_out_incomplete", lines + ": they are left out, as samples that were lost");
  }

  UnitClaim claim(const std::array<std::size_t, 3>& columns, const char* key) {
    UnitClaim said{{}, named_[columns[0]].increment};
    for (const std::size_t column : columns) {
      const std::string& unit = named_[column].unit;  // some say it once: "gx (dps), gy, gz"
      if (!unit.empty() && !said.unit.empty() && unit != said.unit) {
        doubt(key, "the names of the three columns say different units");
        return {{}, said.increments};
      }
      said.unit = unit.empty() ? said.unit : unit;
    }
    if (const std::string& other = named_[columns[0]].other_unit; said.unit.empty() && !other.empty()) {
      doubt(key, other + " is no unit that is known");
    }
    return said;
  }

  void guess_sensors() {
    ImportMap& map = guess_.map;
    for (std::size_t k = 0; k < 3; ++k) {
      map.gyro.columns[k] = reference((*roles_.gyro)[k]);
      map.accelerometer.columns[k] = reference((*roles_.accelerometer)[k]);
    }
    take_zero_off();
    OrientationInput input;
    input.gyro = triad_columns(values_, *roles_.gyro);
    input.accelerometer = triad_columns(values_, *roles_.accelerometer);
    input.interval_s = interval_s_;
    input.latitude_deg = map.latitude_deg;
    input.axes_by_format = psins_.has_value();
    if (roles_.gimbal) {
      input.gimbal[0] = &values_[(*roles_.gimbal)[0]];
      input.gimbal[1] = &values_[(*roles_.gimbal)[1]];
      input.gimbal_named = roles_.gimbal_named;
      const std::string& unit = named_[(*roles_.gimbal)[0]].unit;
      input.gimbal_unit = find_unit(unit) && find_unit(unit)->quantity == Quantity::angle ? unit : std::string();
    }
    const std::vector<Table> tables = tables_of(input);
    input.on_a_table = !tables.empty();
    Orientation orientation = find_orientation(input, guess_.remarks);
    if (tables.empty()) {
      set_gimbal(orientation);
    } else {
      set_table(tables, orientation);
    }
    if (psins_) {
      return set_psins();
    }
    set_axes(orientation.gyro, map.gyro);
    set_axes(orientation.accelerometer, map.accelerometer);
    guess_accelerometer_unit();
    guess_gyro_unit(orientation);
  }

  // Counts around a middle: the sphere through gravity's directions has its centre there.
  void take_zero_off() {
    const TriadColumns columns = triad_columns(values_, *roles_.accelerometer);
    const auto claimed = find_unit(named_[roles_.accelerometer->front()].unit);
    if (psins_ ||
        (claimed && (claimed->quantity == Quantity::acceleration || claimed->quantity == Quantity::velocity))) {
      return;
    }
    const std::optional<Vector3> zero = centre_of_gravity_sphere(triad_columns(values_, *roles_.gyro), columns);
    if (!zero) {
      return;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      guess_.map.accelerometer.zero[k] = std::round((*zero)[static_cast<int>(k)]) + 0.0;  // no -0
      for (double& value : values_[(*roles_.accelerometer)[k]]) {
        value -= guess_.map.accelerometer.zero[k];
      }
    }
    doubt("accelerometer.zero",
          fmt::format(
              "counts {:.0f}, {:.0f}, {:.0f} mean no force: the centre of gravity's directions; biases are in it",
              guess_.map.accelerometer.zero[0], guess_.map.accelerometer.zero[1], guess_.map.accelerometer.zero[2]));
  }

  void set_psins() {
    ImportMap& map = guess_.map;
    map.gyro.increments = map.accelerometer.increments = true;
    map.gyro.unit = "arcsec";
    map.gyro.scale = psins_->gyro_arcsec;
    map.accelerometer.unit = "m/s";
    map.accelerometer.scale = psins_->accelerometer_mps;
    map.gyro.axes = map.accelerometer.axes = {{{1, 1.0}, {2, 1.0}, {0, 1.0}}};
    say("gyro.unit", "counts; what one is worth, for both triads, from the file's header");
    say("gyro.axes", "PSINS: x right, y forward, z up; b: x forward, y up, z right");
  }

  void set_gimbal(const Orientation& orientation) {
    GimbalMap& gimbal = guess_.map.gimbal;
    if (roles_.gimbal) {
      const std::size_t outer = (*roles_.gimbal)[orientation.swapped ? 1 : 0];
      const std::size_t inner = (*roles_.gimbal)[orientation.swapped ? 0 : 1];
      gimbal.outer = reference(outer);
      gimbal.inner = reference(inner);
      gimbal.unit = orientation.gimbal_unit;
      gimbal.signs = orientation.signs;
      say("gimbal.outer", fmt::format("outer {}, inner {}{}", source_.title(outer), source_.title(inner),
                                      roles_.gimbal_named ? ", by their names" : ": so gravity and the turns fit"));
    } else if (orientation.moves) {
      gimbal.absent = true;
      say("gimbal", fmt::format("no read-outs {}, though the sensor turns: good for `selfcal poses`, not for the 24",
                                roles_.angle ? "that fit" : "in the file"));
    } else {
      gimbal.fixed_deg = {0.0, 0.0};
      say("gimbal", orientation.turns ? "read-outs are written as 0, though the gyros show turns"
                                      : "nothing turns: read-outs are written as 0");
    }
  }

  // Of the rows at the rate that was found, s; where none was, in rows.
  std::vector<double> times() const {
    std::vector<double> all(values_.front().size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k] = static_cast<double>(k) * interval_s_.value_or(1.0);
    }
    return all;
  }

  // Empty: no column of angles, or the gyros do not follow it.
  std::vector<Table> tables_of(const OrientationInput& input) {
    if (!roles_.angle || psins_) {
      return {};
    }
    const std::size_t gyro = roles_.gyro->front();
    std::string claimed = named_[*roles_.angle].unit;
    if (roles_.angle_is_rate) {
      values_[*roles_.angle] = angle_of_rate(values_[*roles_.angle], times());
      claimed = claimed.substr(0, claimed.find("/s"));
    }
    TableFit fit = fit_table(input.gyro, input.accelerometer, values_[*roles_.angle], claimed,
                             {named_[gyro].unit, named_[gyro].increment}, interval_s_);
    if (fit.ways.empty()) {
      doubt("gimbal", fit.good ? fmt::format("{}: the gyros show its turns, but not in the unit of their names",
                                             source_.title(*roles_.angle))
                               : fmt::format("{}: angles by the name, but they explain {:.0f} % of the gyros' turns",
                                             source_.title(*roles_.angle), 100.0 * fit.explained));
    }
    return std::move(fit.ways);
  }

  void set_table(const std::vector<Table>& tables, Orientation& orientation) {
    const TableAxis& axis = tables.front().axis;
    const Vector3 about = orientation.gyro * axis.per_rad.normalized();
    Eigen::Index along = 0;
    about.cwiseAbs().maxCoeff(&along);
    GimbalMap& gimbal = guess_.map.gimbal;
    const bool inner = along == 1;  // outer turns about z, inner about y
    (inner ? gimbal.inner : gimbal.outer) = reference(*roles_.angle);
    gimbal.signs[inner ? 1 : 0] = about(along) < 0.0 ? -1.0 : 1.0;
    gimbal.unit = tables.front().unit + (roles_.angle_is_rate ? "/s" : "");
    const std::string title = source_.title(*roles_.angle);
    say(inner ? "gimbal.inner" : "gimbal.outer",
        fmt::format("{}, {}a table with one axis: its turns are {:.1f} % of what the gyros show{}, mostly about {}{}",
                    title, roles_.angle_is_rate ? "the rate, added up, of " : "", 100.0 * axis.explained,
                    axis.turns > 0 ? fmt::format(" in {} turns", axis.turns) : std::string(),
                    about(along) < 0.0 ? "-" : "", "xyz"[along]));
    say("gimbal", "one read-out: good for `selfcal poses`, not for the 24; that of the other axis is written as 0");
    if (along == 0) {
      doubt("gimbal.outer", "it turns about x, which is neither the outer nor the inner axis: taken for the outer one");
    }
    if (tables.size() > 1) {
      doubt("gimbal.unit",
            fmt::format("{} or {}: the gyros' unit is not known either", tables[0].unit, tables[1].unit));
    }
    if (!roles_.angle_of_a_table) {
      doubt("gimbal", fmt::format("{} may be an attitude that was computed from these gyros, and no read-out", title));
    }
    if (!orientation.rad_per_sample && tables.size() == 1) {
      orientation.rad_per_sample = 1.0 / axis.per_rad.norm();
    }
  }

  void guess_gyro_unit(const Orientation& orientation) {
    TriadMap& gyro = guess_.map.gyro;
    const UnitClaim said = claim(*roles_.gyro, "gyro.unit");
    const auto claimed = find_unit(said.unit);
    if (!orientation.rad_per_sample || !interval_s_) {
      const bool increments = said.increments || (!claimed && guess_.map.accelerometer.increments);
      gyro.unit = claimed ? std::string(claimed->name) : increments ? "rad" : "rad/s";
      gyro.increments = find_unit(gyro.unit)->quantity == Quantity::angle;
      const char* why = !interval_s_ ? "the sample rate is not known" : "no turn that shows it";
      // "gyro_rad" of PX4 is a rate, other people's are increments.
      const bool angle = claimed && gyro.increments && !said.increments;
      why = angle                            ? "increments, or so much a second; no turn shows which"
            : increments && !said.increments ? "increments, as the accelerometers'; no turn that shows it"
                                             : why;
      return claimed && interval_s_ && !angle
                 ? say("gyro.unit", fmt::format("{} by its name; {}", gyro.unit, why))
                 : doubt("gyro.unit",
                         fmt::format("{}{}: {}", gyro.unit, claimed ? " by its name" : " or any other", why));
    }
    auto fit = gyro_unit(*orientation.rad_per_sample, *interval_s_, said);
    // "gyro_rad" of PX4 is a rate.
    if (!fit && !said.increments && claimed && claimed->quantity == Quantity::angle) {
      fit = gyro_unit(*orientation.rad_per_sample, *interval_s_, {said.unit + "/s", false});
    }
    if (fit) {
      gyro.unit = fit->unit;
      gyro.increments = fit->increments;
      say("gyro.unit", fmt::format("{} ({}): the turns show it within {:.1f} %", fit->unit,
                                   fit->increments ? "increments" : "rates", 100.0 * std::expm1(fit->off)));
      if (!fit->rivals.empty()) {
        doubt("gyro.unit", fmt::format("{} or {}: both fit the turns", fit->unit, fmt::join(fit->rivals, ", ")));
      } else if (said.unit.empty() && fit->off > nearness(triad_columns(values_, *roles_.gyro))) {
        doubt("gyro.unit", fmt::format("{} within {:.1f} %; what a count of an instrument means may be as near",
                                       fit->unit, 100.0 * std::expm1(fit->off)));
      } else if (constexpr double much = 0.05; fit->off > much) {
        doubt("gyro.unit",
              fmt::format("{}, but the turns show {:.1f} % of another size: rows that are lost in turns, or the time",
                          fit->unit, 100.0 * std::expm1(fit->off)));
      } else if (said.unit.empty() && is_doubted("time")) {
        doubt("gyro.unit", fmt::format("{} follows from the time, which is doubted", fit->unit));
      }
      return;
    }
    // Counts, or another unit than the name's. Where the turns are near to one, its size is known, and what they differ by are the gyros' own
    // scale factors.
    const auto other = gyro_unit(*orientation.rad_per_sample, *interval_s_, {{}, said.increments});
    constexpr double near = 0.03;
    if (claimed && other && other->rivals.empty() && other->off < near) {
      gyro.unit = other->unit;
      gyro.increments = other->increments;
      return doubt("gyro.unit", fmt::format("{} by the name contradicts the turns, which show {} within {:.1f} %",
                                            said.unit, other->unit, 100.0 * std::expm1(other->off)));
    }
    gyro.increments = said.increments;
    gyro.unit = said.increments ? "rad" : "rad/s";
    const double scale = *orientation.rad_per_sample / (said.increments ? 1.0 : *interval_s_);
    gyro.scale = {scale, scale, scale};
    doubt("gyro.unit",
          claimed
              ? fmt::format("{} by the name contradicts the turns; by these a number is {:.4g} {}, and scale factors "
                            "that all gyros share do not show",
                            said.unit, scale, gyro.unit)
              : fmt::format("counts: the turns show {:.4g} {} a count; the data sheet's value belongs here", scale,
                            gyro.unit));
  }

  void guess_accelerometer_unit() {
    TriadMap& accel = guess_.map.accelerometer;
    const UnitClaim said = claim(*roles_.accelerometer, "accelerometer.unit");
    const double size = usual_force(triad_columns(values_, *roles_.accelerometer));
    // Without a rate only a named rate can be told.
    const auto claimed = find_unit(said.unit);
    const double interval = interval_s_.value_or(1.0);
    const auto fit = size > 0.0 && (interval_s_ || claimed) ? accelerometer_unit(size, interval, said) : std::nullopt;
    if (fit) {
      accel.unit = fit->unit;
      accel.increments = fit->increments;
      say("accelerometer.unit",
          fmt::format("{} ({}): gravity is {:.5g} of it", fit->unit, fit->increments ? "increments" : "rates", size));
      if (!fit->rivals.empty() || (!interval_s_ && fit->increments)) {
        doubt("accelerometer.unit",
              fmt::format("{} or {}: gravity fits both", fit->unit, fmt::join(fit->rivals, ", ")));
      } else if (said.unit.empty() && fit->off > nearness(triad_columns(values_, *roles_.accelerometer))) {
        doubt("accelerometer.unit",
              fmt::format("{} within {:.1f} %; what a count of an instrument means may be as near", fit->unit,
                          100.0 * std::expm1(fit->off)));
      } else if (said.unit.empty() && is_doubted("time")) {
        doubt("accelerometer.unit", fmt::format("{} was found with the time, which is doubted", fit->unit));
      }
      return;
    }
    accel.increments = said.increments;
    if (claimed && (claimed->quantity == Quantity::acceleration || claimed->quantity == Quantity::velocity)) {
      accel.unit = claimed->name;
      const bool light = size * claimed->si < 2.0 * (claimed->quantity == Quantity::velocity ? interval : 1.0);
      return doubt("accelerometer.unit",
                   fmt::format("{} by the name, but the usual force is {:.5g} of it: {}", said.unit, size,
                               light ? "gravity is not in it, as in a phone's linear acceleration"
                                     : "a sensor that moves, or another unit"));
    }
    const auto rates =
        interval_s_ || said.increments || !(size > 0.0) ? std::nullopt : accelerometer_unit(size, 1.0, {});
    if (rates && !rates->increments && rates->off < nearness(triad_columns(values_, *roles_.accelerometer))) {
      accel.unit = rates->unit;
      return doubt("accelerometer.unit",
                   fmt::format("{} if these are rates: gravity is {:.5g} of it, and the sample rate "
                               "is not known",
                               rates->unit, size));
    }
    accel.unit = said.increments ? "m/s" : "m/s^2";
    if (!said.increments && says_no_gravity(source_.names()[roles_.accelerometer->front()])) {
      return doubt("accelerometer.unit",
                   fmt::format("{}: gravity is not in it by its name, and the usual force is {:.5g}",
                               source_.title(roles_.accelerometer->front()), size));
    }
    const double scale = 9.80665 * (said.increments ? interval : 1.0) / size;
    accel.scale = {scale, scale, scale};
    doubt("accelerometer.unit",
          fmt::format("counts: gravity is {:.5g} of them, zero offsets included; scale and zero of "
                      "the data sheet belong here",
                      size));
  }

  void guess_temperature() {
    ImportMap& map = guess_.map;
    for (const std::size_t column : roles_.temperature) {
      map.temperature.push_back(reference(column));
    }
    if (roles_.temperature.empty()) {
      return;
    }
    const std::vector<double>& values = values_[roles_.temperature.front()];
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    const bool whole = std::all_of(values.begin(), values.end(), [](double v) { return v == std::floor(v); });
    const TemperatureFit fit =
        temperature_unit(mean, named_[roles_.temperature.front()].unit, whole, is_doubted("gyro.unit"));
    map.temperature_unit = fit.unit;
    guess_.remarks.push_back({"temperature.unit", fit.words, fit.doubt});
  }

  const ColumnSource& source_;
  const GuessKnowledge& known_;
  Values values_;
  LeftOutRows lost_;  // rows of the file that values_ is without
  std::vector<NamedColumn> named_;
  Roles roles_;
  std::optional<PsinsHeader> psins_;
  std::optional<double> interval_s_;
  Guess guess_;
};

}  // namespace

Expected<Guess> guess_map(const ColumnSource& source, const GuessKnowledge& knowledge, const std::string& file) {
  const std::size_t columns = source.names().size();
  if (const std::string mixed = source.mixed_rows(); !mixed.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, mixed));
  }
  if (columns < fewest_columns) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: {} columns; three gyros and three accelerometers are expected: a recording "
                            "holds both triads; 'selfcal poses --only' answers for a log of one",
                            file, source.form(), columns));
  }
  ColumnRequest request;
  request.tolerant = true;
  request.columns.resize(columns);
  std::iota(request.columns.begin(), request.columns.end(), std::size_t{0});
  request.most_rows = most_numbers / columns;
  Expected<ColumnData> data = source.read(request);
  constexpr std::size_t fewest_rows = 200;
  if (!data) {
    return tl::unexpected(data.error());
  }
  if (data->rows < fewest_rows) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} lines of numbers; {} are needed to judge by", file, data->rows, fewest_rows));
  }
  LeftOutRows lost = rows_to_leave_out(*data, 0.01);  // a column that lacks more is no sensor's
  leave_out(lost.rows, *data);
  Guess guess = Guesser(source, knowledge, std::move(data->values), std::move(lost)).guess();
  if (data->left_out) {
    const std::string words = fmt::format("judged by {} rows", request.most_rows);
    guess.remarks.insert(guess.remarks.begin(), Remark{"columns", words, false});
  }
  return guess;
}

}  // namespace selfcal::import
