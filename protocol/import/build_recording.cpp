#include "protocol/import/build_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "estimator/geometry/units.hpp"
#include "protocol/import/full_words.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/resample.hpp"
#include "protocol/import/table_read_outs.hpp"
#include "protocol/import/time_axis.hpp"
#include "protocol/import/time_steps.hpp"
#include "protocol/import/units.hpp"
#include "protocol/toml_file/nearest_word.hpp"

namespace selfcal::import {
namespace {

// Where the columns of each part of the map stand in ColumnData::values.
struct Places {
  std::array<std::size_t, 3> gyro{};
  std::array<std::size_t, 3> accelerometer{};
  std::size_t outer = 0;
  std::size_t inner = 0;
  std::vector<std::size_t> temperature;
};

// The columns that a map wants, as numbers from 0; the first fault is kept.
class Columns {
 public:
  Columns(const ColumnSource& source, const ImportMap& map) : source_(source), map_(map) {}

  std::size_t place(const ColumnRef& ref, const char* key) {
    const std::size_t column = find(ref, key);
    const auto known = std::find(request.columns.begin(), request.columns.end(), column);
    if (known == request.columns.end()) {
      request.columns.push_back(column);
      return request.columns.size() - 1;
    }
    return static_cast<std::size_t>(known - request.columns.begin());
  }
  std::size_t find(const ColumnRef& ref, const char* key) {
    const std::vector<std::string>& names = source_.names();
    if (ref.number > 0) {
      if (ref.number > names.size()) {
        refuse(key, fmt::format("column {}; the file has {}", ref.number, names.size()));
      }
      return ref.number - 1;
    }
    const auto named = std::count(names.begin(), names.end(), ref.name);
    if (named != 1) {
      refuse(key, fmt::format("\"{}\" is the name of {}{}", ref.name,
                              named == 0 ? "no column" : "several columns: take a number",
                              named == 0 ? did_you_mean(ref.name, std::span<const std::string>(names)) : ""));
    }
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), ref.name) - names.begin());
  }
  void refuse(const char* key, const std::string& what) {
    if (!fault) {
      fault = map_.error_at(key, what);
    }
  }

  ColumnRequest request;
  std::optional<Error> fault;

 private:
  const ColumnSource& source_;
  const ImportMap& map_;
};

Places find_columns(const ImportMap& map, Columns& columns) {
  Places places;
  for (std::size_t k = 0; k < 3; ++k) {
    places.gyro[k] = columns.place(map.gyro.columns[k], "gyro.columns");
    places.accelerometer[k] = columns.place(map.accelerometer.columns[k], "accelerometer.columns");
  }
  if (map.gimbal.outer) {
    places.outer = columns.place(*map.gimbal.outer, "gimbal.outer");
  }
  if (map.gimbal.inner) {
    places.inner = columns.place(*map.gimbal.inner, "gimbal.inner");
  }
  for (const ColumnRef& ref : map.temperature) {
    places.temperature.push_back(columns.place(ref, "temperature.columns"));
  }
  if (map.time.column) {
    columns.request.stamp = columns.find(*map.time.column, "time.column");
    columns.request.stamp_is_date = map.time.unit == "date";
  }
  return places;
}

// A factor of 1 leaves every bit.
double scaled(double value, double factor) { return factor == 1.0 ? value : value * factor; }

// Increments over each row's interval, along the axes of b.
std::vector<std::array<double, 3>> triad(const TriadMap& map, const std::array<std::size_t, 3>& places,
                                         const ColumnData& data, const std::vector<double>& interval_s) {
  const double si = find_unit(map.unit).value_or(Unit{{}, Quantity::angle, 1.0}).si;
  std::vector<std::array<double, 3>> all(data.rows);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto column = static_cast<std::size_t>(map.axes[k].column);
    const std::vector<double>& raw = data.values[places[column]];
    const double factor = map.scale[column] * si;
    for (std::size_t row = 0; row < data.rows; ++row) {
      double value = map.zero[column] == 0.0 ? raw[row] : raw[row] - map.zero[column];
      value = scaled(value, factor);
      value = map.increments ? value : value * interval_s[row];
      all[row][k] = map.axes[k].sign < 0.0 ? -value : value;
    }
  }
  return all;
}

std::vector<double> read_out(const GimbalMap& map, std::size_t which, const std::vector<double>& column,
                             const std::vector<double>& time_s) {
  const Unit unit = find_unit(map.unit).value_or(Unit{{}, Quantity::angle, 1.0});
  const double si = unit.si;
  const std::vector<double> raw = unit.quantity == Quantity::angular_rate ? angle_of_rate(column, time_s) : column;
  const double offset = map.offsets_deg[which] * units::degree;
  std::vector<double> angle(raw.size());
  for (std::size_t row = 0; row < raw.size(); ++row) {
    const double value = scaled(raw[row], si);
    angle[row] = (map.signs[which] < 0.0 ? -value : value) + (offset == 0.0 ? 0.0 : offset);
  }
  return angle;
}

void set_gimbal(const GimbalMap& map, const Places& places, const ColumnData& data, Imported& imported) {
  Recording& recording = imported.recording;
  if (map.outer || map.inner) {
    const std::vector<double> none(data.rows, 0.0);  // of a table with one axis
    recording.gimbal_outer_rad = map.outer ? read_out(map, 0, data.values[places.outer], recording.time_s) : none;
    recording.gimbal_inner_rad = map.inner ? read_out(map, 1, data.values[places.inner], recording.time_s) : none;
    const auto unit = find_unit(map.unit);
    if (unit && unit->quantity == Quantity::angular_rate) {
      imported.notes.emplace_back("gimbal: rates, added up from the first row on; where that stood nobody says");
    }
    if (!map.outer || !map.inner) {
      imported.notes.push_back(
          fmt::format("one read-out: that of the {} axis is written as 0", map.outer ? "inner" : "outer"));
    }
    return;
  }
  const std::array<double, 2> fixed = map.fixed_deg.value_or(std::array<double, 2>{});
  recording.gimbal_outer_rad.assign(data.rows, fixed[0] * units::degree);
  recording.gimbal_inner_rad.assign(data.rows, fixed[1] * units::degree);
  recording.gimbal_absent = map.absent;
  imported.notes.push_back(
      map.absent ? std::string("no gimbal: its read-outs are written as 0, which say nothing")
                 : fmt::format("gimbal read-outs are written as {} and {} deg throughout", fixed[0], fixed[1]));
}

void set_temperature(const ImportMap& map, const Places& places, const ColumnData& data, Recording& recording) {
  recording.temperature_channels = places.temperature.size();
  recording.temperature_c.resize(data.rows * places.temperature.size());
  for (std::size_t channel = 0; channel < places.temperature.size(); ++channel) {
    const std::vector<double>& raw = data.values[places.temperature[channel]];
    for (std::size_t row = 0; row < data.rows; ++row) {
      recording.temperature_c[row * places.temperature.size() + channel] = celsius(raw[row], map.temperature_unit);
    }
  }
}

Expected<void> check_settled(const ImportMap& map) {
  if (!map.unsettled.empty()) {
    return tl::unexpected(
        map.error_at("unsettled", fmt::format("{}: say what is right in the map and take the word off this list",
                                              fmt::join(map.unsettled, ", "))));
  }
  struct Need {
    const char* key;
    bool there;
  };
  for (const auto& [key, there] :
       {Need{"site.latitude_deg", map.latitude_deg.has_value()},
        Need{"site.longitude_deg", map.longitude_deg.has_value()}, Need{"site.height_m", map.height_m.has_value()}}) {
    if (!there) {
      return tl::unexpected(map.error_at(key, "missing: the place where the recording was made"));
    }
  }
  return {};
}

std::vector<double> intervals_of(const TimeAxis& axis, bool by_stamps) {
  std::vector<double> interval(axis.end_s.size(), 1.0 / axis.rate_hz);
  for (std::size_t k = 1; by_stamps && k < interval.size(); ++k) {
    interval[k] = axis.end_s[k] - axis.end_s[k - 1];
  }
  return interval;
}

// A row that is the one before in its time and in all that is read of it was written twice.
void take_once(ColumnData& data, std::vector<std::string>& notes) {
  if (data.stamps.empty()) {
    return;
  }
  const std::vector<bool> repeated = repeated_rows(data);
  if (const auto count = std::count(repeated.begin(), repeated.end(), true); count > 0) {
    const auto first = static_cast<std::size_t>(std::find(repeated.begin(), repeated.end(), true) - repeated.begin());
    notes.push_back(fmt::format("{} rows are the row before once more and are taken once, the first at {}", count,
                                data.place(first)));
    leave_out(repeated, data);
  }
}

// Words of 16 bits without a sign, and full ones, of the sensors.
void continue_words(const Places& places, ColumnData& data, std::vector<std::string>& notes) {
  std::size_t columns = 0;
  for (const std::array<std::size_t, 3>& triad : {places.gyro, places.accelerometer}) {
    for (const std::size_t place : triad) {
      columns += continue_full_words(data.values[place]) ? 1 : 0;
    }
  }
  if (columns > 0) {
    notes.push_back(fmt::format("words of 16 bits, full at 65536, are continued in {} columns", columns));
  }
}

// Strictly, or without the rows that lack a number, which the notes then say.
Expected<ColumnData> read_rows(const ColumnSource& source, ColumnRequest request, const ImportMap& map,
                               const std::string& file, std::vector<std::string>& notes) {
  if (!map.time.leave_out_incomplete) {
    return source.read(request);
  }
  request.tolerant = true;
  return source.read(request).and_then([&](ColumnData data) -> Expected<ColumnData> {
    if (data.left_out) {
      return fail(ErrorKind::bad_input, fmt::format("{}: more than {} lines of numbers", file, request.most_rows));
    }
    constexpr double most_lost = 0.1;  // as of any recording
    const std::vector<bool> lost = incomplete_rows(data, 1.0);
    const auto count = std::count(lost.begin(), lost.end(), true);
    if (static_cast<double>(count) > most_lost * static_cast<double>(data.rows)) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {} of {} lines lack a number; at most a tenth is left out", file, count, data.rows));
    }
    if (count > 0) {
      const auto first = static_cast<std::size_t>(std::find(lost.begin(), lost.end(), true) - lost.begin());
      notes.push_back(fmt::format("{} lines lack a number and are left out as lost samples, the first at {}", count,
                                  data.place(first)));
      leave_out(lost, data);
    }
    return data;
  });
}

Expected<Imported> build(const ColumnSource& source, const ImportMap& map, const std::string& file) {
  if (const auto settled = check_settled(map); !settled) {
    return tl::unexpected(settled.error());
  }
  Columns columns(source, map);
  const Places places = find_columns(map, columns);
  if (columns.fault) {
    return tl::unexpected(*columns.fault);
  }
  Imported imported;
  Expected<ColumnData> data = read_rows(source, columns.request, map, file, imported.notes);
  if (!data) {
    return tl::unexpected(data.error());
  }
  take_once(*data, imported.notes);
  if (std::string words = continue_full_clocks(data->stamps); !words.empty()) {
    imported.notes.push_back(std::move(words));
  }
  if (std::string words = put_in_order(*data); !words.empty()) {
    imported.notes.push_back(std::move(words));
  }
  continue_words(places, *data, imported.notes);
  constexpr std::size_t fewest = 2;
  if (data->rows < fewest) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} lines of numbers, at least {} needed", file, data->rows, fewest));
  }
  Expected<TimeAxis> axis = time_axis(*data, map, file);
  if (!axis) {
    return tl::unexpected(axis.error());
  }
  imported.notes.insert(imported.notes.end(), axis->notes.begin(), axis->notes.end());
  Recording& recording = imported.recording;
  recording.serial = map.serial;
  recording.start_time_utc = map.start_time_utc;
  recording.sample_rate_hz = axis->rate_hz;
  recording.latitude_deg = *map.latitude_deg;
  recording.longitude_deg = *map.longitude_deg;
  recording.height_m = *map.height_m;
  recording.dwell_s = map.dwell_s;
  recording.rotation_s = map.rotation_s;
  const std::vector<double> interval = intervals_of(*axis, map.time.interval == "stamps" || map.time.resample);
  recording.delta_theta_rad = triad(map.gyro, places.gyro, *data, interval);
  recording.delta_v_mps = triad(map.accelerometer, places.accelerometer, *data, interval);
  recording.time_s = std::move(axis->end_s);
  set_gimbal(map.gimbal, places, *data, imported);
  set_temperature(map, places, *data, recording);
  if (map.time.resample) {
    Expected<std::string> done = resample(recording);
    if (!done) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, done.error().message));
    }
    imported.notes.push_back(std::move(*done));
  }
  return imported;
}

}  // namespace

Expected<Imported> build_recording(const ColumnSource& source, const ImportMap& map, const std::string& file) {
  try {
    return build(source, map, file);
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::bad_input, fmt::format("{}: does not fit into memory", file));
  }
}

}  // namespace selfcal::import
