#include "tools/cli/poses_input.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/full_words.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/guess_time.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/time_steps.hpp"
#include "protocol/import/units.hpp"
#include "tools/cli/log_counts.hpp"
#include "tools/cli/log_rows.hpp"
#include "tools/cli/log_temperature.hpp"
#include "tools/cli/log_time.hpp"
#include "tools/cli/log_units.hpp"
#include "tools/cli/read_out_columns.hpp"

namespace selfcal::cli {

void set_place(std::optional<double> latitude_deg, std::optional<double> height_m, diagnosis::PoseInput& input) {
  if (latitude_deg) {
    input.latitude = *latitude_deg * units::degree;
    constexpr double heights_m = 500.0, per_m = 3.086e-6;  // sigma of where people work; m/s^2 a metre
    input.gravity = earth::normal_gravity(*input.latitude, height_m.value_or(0.0));
    input.gravity_sigma = height_m ? 0.0 : heights_m * per_m;
  } else {
    constexpr double over_the_earth = 0.015;  // m/s^2: 9.780 to 9.832 at sea level, as likely anywhere
    input.gravity_sigma = over_the_earth;
  }
}

bool has_read_outs(const Recording& recording) {
  const auto zero = [](const std::vector<double>& angles) {
    return std::all_of(angles.begin(), angles.end(), [](double angle) { return angle == 0.0; });
  };
  return !zero(recording.gimbal_outer_rad) || !zero(recording.gimbal_inner_rad);
}

diagnosis::PoseInput pose_input_of(const Recording& recording) {
  diagnosis::PoseInput input;
  input.time_s = recording.time_s;
  const auto rates = [&recording](const std::vector<std::array<double, 3>>& increments) {
    std::vector<std::array<double, 3>> all = increments;
    for (std::array<double, 3>& row : all) {
      for (double& value : row) {
        value *= recording.sample_rate_hz;
      }
    }
    return all;
  };
  input.gyro = rates(recording.delta_theta_rad);
  input.accel = rates(recording.delta_v_mps);
  input.accel_unit = 1.0;
  input.gyros_si = true;
  input.gravity = earth::normal_gravity(recording.latitude_deg * units::degree, recording.height_m);
  input.latitude = recording.latitude_deg * units::degree;
  for (std::size_t i = 0; i < recording.temperature_c.size(); i += recording.temperature_channels) {
    input.temperature_c.push_back(recording.temperature_c[i]);
  }
  if (has_read_outs(recording)) {
    input.outer = recording.gimbal_outer_rad;
    input.inner = recording.gimbal_inner_rad;
  }
  return input;
}

namespace {

using diagnosis::PoseInput;
using diagnosis::Sensors;

constexpr const char* rate_says = "--rate says how many rows a second it holds";

std::string and_also(const std::string& a, const std::string& b) {
  return a + (a.empty() || b.empty() ? "" : "; ") + b;
}

// A column that nobody calls a time and that is none: values that rise by chance, or a counter, whose unit is an interval.
Expected<void> check_time(const TimedRows& rows, const import::ColumnSource& source,
                          const std::vector<import::NamedColumn>& named, const std::string& file) {
  if (const auto increasing = check_increasing(
          file, rows.data,
          ": cut the file there and give both parts, or let --rate say how many rows a second it holds");
      !increasing) {
    return tl::unexpected(increasing.error());
  }
  const std::vector<long double>& stamps = rows.data.stamps;
  if (named[rows.time].role == import::Role::time) {
    return {};
  }
  const bool whole = std::all_of(stamps.begin(), stamps.end(), [](long double s) { return s == std::floor(s); });
  const long double step = stamps.size() > 1 ? stamps[1] - stamps[0] : 0.0L;
  const bool counts = whole && (step == 1.0L || (!source.names()[rows.time].empty() && named[rows.time].unit.empty()));
  if (counts || !import::rises_evenly(stamps)) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} {}: {}", file, source.title(rows.time),
                            counts ? fmt::format("rises by {:g}, as a counter does, and no name calls it a time",
                                                 static_cast<double>(step))
                                   : "does not increase evenly, as a time does",
                            rate_says));
  }
  return {};
}

// The only column that is called a counter, from 1; 0: none.
std::size_t named_counter(const std::vector<import::NamedColumn>& named) {
  const auto is = [](const import::NamedColumn& c) { return c.role == import::Role::counter; };
  const auto found = std::find_if(named.begin(), named.end(), is);
  return std::count_if(named.begin(), named.end(), is) == 1 ? static_cast<std::size_t>(found - named.begin()) + 1 : 0;
}

// Fewer rows are no log.
Expected<void> check_length(const import::ColumnSource& source, const std::string& file) {
  constexpr std::size_t least = 100;
  import::ColumnRequest request;
  request.tolerant = true;
  request.most_rows = least;
  const Expected<import::ColumnData> data = source.read(request);
  return !data || data->rows >= least
             ? Expected<void>()
             : fail(ErrorKind::bad_input,
                    fmt::format("{}: {} rows: a log of samples is wanted, 100 and more, or a table of means of "
                                "accelerometers, a row a position",
                                file, data->rows));
}

// A log as its file has it: SI where its names say units.
struct OneLog {
  PoseInput input;
  double gyro_si = 0.0, accel_si = 0.0;  // 0: raw, or none
  long double begin_s = 0.0L;            // of a time of the calendar: what was taken off
  bool nameless = false;
  std::string notes;
};

// Time in s. A time of the calendar in seconds leaves no digits of an interval: from the first one on.
void add_time(const TimedRows& rows, const std::string& unit, std::optional<double> rate_hz, OneLog& log) {
  if (rate_hz) {
    for (std::size_t i = 0; i < rows.data.rows; ++i) {
      log.input.time_s.push_back(static_cast<double>(i + 1) / *rate_hz);
    }
    return;
  }
  const auto si = static_cast<long double>(import::find_unit(unit)->si);
  constexpr long double calendar_s = 1e7L;
  if (rows.data.rows > 0 && std::abs(rows.data.stamps.front() * si) > calendar_s) {
    log.begin_s = rows.data.stamps.front() * si;
  }
  for (const long double stamp : rows.data.stamps) {
    log.input.time_s.push_back(static_cast<double>(stamp * si - log.begin_s));
  }
}

// Where a counter says that rows were lost the others keep their time.
void take_lost_rows(const std::vector<double>& counter, const std::string& title, double rate_hz, OneLog& log) {
  const auto rows = rows_by_counter(counter);
  if (!rows || rows->back() + 1.0 == static_cast<double>(rows->size())) {
    return;
  }
  for (std::size_t i = 0; i < rows->size(); ++i) {
    log.input.time_s[i] = ((*rows)[i] + 1.0) / rate_hz;
  }
  log.notes = and_also(log.notes, fmt::format("{} counts {:.0f} rows that the log has lost", title,
                                              rows->back() + 1.0 - static_cast<double>(rows->size())));
}

// With a time that a name calls so, or else one that rises; where some fields are empty, what the rows of the slower triad hold.
Expected<TimedRows> rows_of(const import::ColumnSource& source, const std::vector<import::NamedColumn>& named,
                            const PoseLayout& layout, import::ColumnRequest request, const std::string& file) {
  if (!layout.times.empty() &&
      std::none_of(layout.times.begin(), layout.times.end(), [&](std::size_t k) { return holds_stamps(source, k); })) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} holds no time: {}", file, source.title(layout.times.front()), rate_says));
  }
  Expected<TimedRows> rows = read_with_time(source, layout.times, request);
  if (!rows) {
    request.tolerant = true;
    Expected<TimedRows> parts = read_with_time(source, layout.times, request);
    if (parts && fill_incomplete(layout, *parts)) {
      rows = std::move(parts);
    }
  }
  const bool called = std::any_of(layout.times.begin(), layout.times.end(),
                                  [&](std::size_t k) { return named[k].role == import::Role::time; });
  if (layout.by_names && !layout.times.empty() && !called &&
      (!rows || !check_increasing(file, rows->data, {}).has_value())) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: no column is called a time, and none rises as one: {}", file, rate_says));
  }
  return rows;
}

// Minutes and hours that no name calls so make rates that few sensors have.
void note_fast(TimedRows& rows, const import::ColumnSource& source, const import::NamedColumn& named,
               const std::string& unit) {
  constexpr long double usual_hz = 400.0L;
  const std::vector<long double>& stamps = rows.data.stamps;
  constexpr long double calendar_s = 1e7L;  // of those s there is no doubt
  const long double span = stamps.empty() || stamps.front() > calendar_s ? 0.0L : stamps.back() - stamps.front();
  if (named.unit.empty() && unit == "s" && span > 0.0L && static_cast<long double>(stamps.size()) > usual_hz * span) {
    rows.notes =
        and_also(rows.notes, fmt::format("{} is taken for s, which its name does not say: {:.4g} rows a second",
                                         source.title(rows.time),
                                         static_cast<double>(static_cast<long double>(stamps.size()) / span)));
  }
}

Expected<OneLog> read_log(const std::string& path, const RawColumns& columns) {
  const auto source = import::open_columns(path);
  if (!source) {
    return tl::unexpected(source.error());
  }
  if (const auto enough = check_length(**source, path); !enough) {
    return tl::unexpected(enough.error());
  }
  const std::vector<import::NamedColumn> named = import::read_names((*source)->names(), (*source)->units());
  const Expected<PoseLayout> layout = pose_layout(**source, named, columns, path);
  if (!layout) {
    return tl::unexpected(layout.error());
  }
  import::ColumnRequest request;
  request.columns = layout->gyro;
  request.columns.insert(request.columns.end(), layout->accel.begin(), layout->accel.end());
  const auto ask = [&request](std::size_t column) {
    request.columns.push_back(column - 1);
    return request.columns.size() - 1;
  };
  const Expected<ReadOutColumns> table = read_out_columns(**source, named, *layout, columns, path);
  if (!table) {
    return tl::unexpected(table.error());
  }
  std::vector<std::size_t> turned;
  for (const ReadOutColumn& axis : table->axes) {
    turned.push_back(ask(axis.column + 1));
  }
  const std::size_t thermal = columns.temperature > 0 ? columns.temperature : named_temperature(named);
  const std::size_t temperature = thermal > 0 ? ask(thermal) : 0;
  const std::size_t counter = columns.rate_hz ? named_counter(named) : 0;
  const std::size_t counted = counter > 0 ? ask(counter) : 0;
  Expected<TimedRows> rows = rows_of(**source, named, *layout, request, path);
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  std::string unit = "s";
  if (!layout->times.empty()) {
    if (const auto good = check_time(*rows, **source, named, path); !good) {
      return tl::unexpected(good.error());
    }
    Expected<std::string> found = time_unit(*rows, **source, named, path, rate_says);
    if (!found) {
      return tl::unexpected(found.error());
    }
    unit = std::move(*found);
    note_fast(*rows, **source, named[rows->time], unit);
  }
  OneLog log;
  PoseInput& input = log.input;
  input.sensors = layout->sensors;
  log.nameless = !layout->by_names && layout->sensors == Sensors::both && layout->gyro.front() < layout->accel.front();
  add_time(*rows, unit, columns.rate_hz, log);
  if (counter > 0) {
    take_lost_rows(rows->data.values[counted], (*source)->title(counter - 1), *columns.rate_hz, log);
  }
  log.gyro_si = columns.raw_gyros ? 0.0 : unit_of(named, layout->gyro, import::Quantity::angular_rate);
  log.accel_si = unit_of(named, layout->accel, import::Quantity::acceleration);
  std::vector<std::size_t> full;
  for (std::size_t k = 0; k < layout->gyro.size() + layout->accel.size(); ++k) {
    const bool raw = k < layout->gyro.size() ? log.gyro_si == 0.0 : log.accel_si == 0.0;
    if (raw && import::continue_full_words(rows->data.values[k])) {
      full.push_back(request.columns[k] + 1);
    }
  }
  if (!full.empty()) {
    log.notes = and_also(log.notes, fmt::format("words of 16 bits, full at 65536, are continued in column{} {}",
                                                full.size() > 1 ? "s" : "", fmt::join(full, ", ")));
  }
  log.notes = and_also(and_also(log.notes, (*source)->put_together()), rows->notes);
  log.notes = and_also(and_also(log.notes, layout->notes), layout_words(*layout, rows->time, unit, columns));
  log.notes = and_also(log.notes, table->notes);
  const std::vector<std::vector<double>>& values = rows->data.values;
  if (layout->only_axis >= 0) {
    input.gyro_axes = {layout->only_axis == 0, layout->only_axis == 1, layout->only_axis == 2};
  }
  for (std::size_t i = 0; i < rows->data.rows; ++i) {
    std::array<double, 3> rate{}, force{};
    for (std::size_t k = 0; k < layout->gyro.size(); ++k) {
      const std::size_t axis = layout->only_axis >= 0 ? static_cast<std::size_t>(layout->only_axis) : k;
      rate[axis] = values[k][i] * (log.gyro_si > 0.0 ? log.gyro_si : 1.0);
    }
    for (std::size_t k = 0; k < layout->accel.size(); ++k) {
      force[k] = values[layout->gyro.size() + k][i] * (log.accel_si > 0.0 ? log.accel_si : 1.0);
    }
    input.gyro.push_back(rate);
    input.accel.push_back(force);
  }
  if (!turned.empty()) {
    input.outer = read_out_angles(table->axes.front(), values[turned.front()], input.time_s);
    input.inner = turned.size() > 1 ? read_out_angles(table->axes[1], values[turned[1]], input.time_s)
                                    : std::vector<double>(input.outer.size(), 0.0);
  }
  if (thermal > 0) {
    LogTemperature taken =
        temperature_of(rows->data.values[temperature], named[thermal - 1], (*source)->title(thermal - 1),
                       columns.temperature > 0, log.gyro_si == 0.0 && log.accel_si == 0.0);
    input.temperature_c = std::move(taken.celsius);
    log.notes = and_also(log.notes, taken.notes);
  }
  return log;
}

// On one clock: accelerometers between two of their rows linearly, at the times of the gyros, which are added up through turns.
Expected<OneLog> joined(const OneLog& accel, OneLog gyro, const RawFiles& files) {
  OneLog all = std::move(gyro);
  const std::vector<double>& from = accel.input.time_s;
  const double ahead = static_cast<double>(all.begin_s - accel.begin_s);
  PoseInput input;
  input.sensors = Sensors::both;
  std::size_t k = 1;
  for (std::size_t i = 0; i < all.input.time_s.size(); ++i) {
    const double t = all.input.time_s[i] + ahead;
    if (t < from.front() || t > from.back()) {
      continue;
    }
    while (k + 1 < from.size() && from[k] < t) {
      ++k;
    }
    const double share = (t - from[k - 1]) / (from[k] - from[k - 1]);
    std::array<double, 3> force{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      force[axis] = (1.0 - share) * accel.input.accel[k - 1][axis] + share * accel.input.accel[k][axis];
    }
    input.time_s.push_back(all.input.time_s[i]);
    input.gyro.push_back(all.input.gyro[i]);
    input.accel.push_back(force);
  }
  constexpr double enough = 0.5;
  if (static_cast<double>(input.time_s.size()) < enough * static_cast<double>(all.input.time_s.size())) {
    return fail(ErrorKind::bad_input,
                fmt::format("{} and {}: their times do not overlap: {:.10g} to {:.10g} s and {:.10g} to {:.10g} s",
                            files.poses.front(), files.gyros, from.front() + static_cast<double>(accel.begin_s),
                            from.back() + static_cast<double>(accel.begin_s),
                            all.input.time_s.front() + static_cast<double>(all.begin_s),
                            all.input.time_s.back() + static_cast<double>(all.begin_s)));
  }
  all.input = std::move(input);
  all.accel_si = accel.accel_si;
  all.notes = and_also(and_also(accel.notes, all.notes), "both files are taken to have one clock");
  return all;
}

// Behind the other, a minute later: what is between them nobody knows.
void append(const OneLog& next, OneLog& all) {
  constexpr double apart_s = 60.0;
  const double shift = all.input.time_s.back() + apart_s - next.input.time_s.front();
  for (const double t : next.input.time_s) {
    all.input.time_s.push_back(t + shift);
  }
  const auto add = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  add(all.input.gyro, next.input.gyro);
  add(all.input.accel, next.input.accel);
  add(all.input.temperature_c, next.input.temperature_c);
  add(all.input.outer, next.input.outer);
  add(all.input.inner, next.input.inner);
}

Expected<OneLog> read_all(const RawFiles& files, const RawColumns& columns) {
  RawColumns first = columns;
  if (!files.gyros.empty()) {
    first.sensors = Sensors::accelerometers;
  }
  Expected<OneLog> log = read_log(files.poses.front(), first);
  if (!log || log->input.time_s.empty()) {
    return log ? fail(ErrorKind::bad_input, fmt::format("{}: no rows", files.poses.front())) : std::move(log);
  }
  if (!files.gyros.empty()) {
    RawColumns own = columns;
    own.sensors = Sensors::gyros;
    own.angle = own.turn_rate = own.temperature = 0;
    own.table_by_names = false;
    Expected<OneLog> gyro = read_log(files.gyros, own);
    if (gyro && columns.rate_hz && gyro->input.time_s.size() != log->input.time_s.size()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{} and {}: {} and {} rows: of one rate and no times they would be as many",
                              files.poses.front(), files.gyros, log->input.time_s.size(), gyro->input.time_s.size()));
    }
    return gyro && gyro->input.time_s.size() > 1 && log->input.time_s.size() > 1 ? joined(*log, std::move(*gyro), files)
                                                                                 : std::move(gyro);
  }
  for (std::size_t k = 1; k < files.poses.size(); ++k) {
    const Expected<OneLog> next = read_log(files.poses[k], columns);
    if (!next) {
      return tl::unexpected(next.error());
    }
    if (next->input.sensors != log->input.sensors || next->gyro_si != log->gyro_si || next->accel_si != log->accel_si ||
        next->input.temperature_c.empty() != log->input.temperature_c.empty() ||
        next->input.outer.empty() != log->input.outer.empty() || next->input.time_s.empty()) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: its columns are others than those of {}", files.poses[k], files.poses.front()));
    }
    append(*next, *log);
  }
  if (files.poses.size() > 1) {
    log->notes = and_also(fmt::format("{} files, a minute between them", files.poses.size()), log->notes);
  }
  return log;
}

}  // namespace

Expected<RawLog> read_raw_poses(const RawFiles& files, const RawColumns& columns) {
  Expected<OneLog> read = read_all(files, columns);
  if (!read) {
    return tl::unexpected(read.error());
  }
  RawLog log{std::move(read->input), false, read->begin_s, read->nameless, std::move(read->notes)};
  const bool gyros = log.input.sensors != Sensors::accelerometers, accels = log.input.sensors != Sensors::gyros;
  log.si = (!gyros || read->gyro_si > 0.0) && (!accels || read->accel_si > 0.0);
  log.input.gyros_si = read->gyro_si > 0.0;
  log.input.accel_unit = accels && read->accel_si > 0.0 ? 1.0 : 0.0;
  set_place(files.latitude_deg, files.height_m, log.input);
  return log;
}

}  // namespace selfcal::cli
