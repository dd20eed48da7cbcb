#include "tools/cli/poses_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::cli {

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

using Triad = std::array<std::size_t, 3>;

// The only x, y and z of a role.
std::optional<Triad> triad_of(const std::vector<import::NamedColumn>& named, import::Role role) {
  Triad triad{};
  std::array<int, 3> found{};
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].role == role && named[k].axis >= 0) {
      triad.at(static_cast<std::size_t>(named[k].axis)) = k;
      ++found.at(static_cast<std::size_t>(named[k].axis));
    }
  }
  return found == std::array{1, 1, 1} ? std::optional(triad) : std::nullopt;
}

struct Layout {
  std::size_t time = 0;
  Triad gyro{}, accel{};
};

// Where no name says it.
Layout plain_layout(diagnosis::Sensors sensors) {
  return {0, {1, 2, 3}, sensors == diagnosis::Sensors::both ? Triad{4, 5, 6} : Triad{1, 2, 3}};
}

Layout layout_of(const std::vector<import::NamedColumn>& named, diagnosis::Sensors sensors) {
  const auto one = [&](import::Role role) {
    const auto by_role = triad_of(named, role);
    return by_role || sensors == diagnosis::Sensors::both ? by_role : triad_of(named, import::Role::unknown);
  };
  const auto gyro = one(import::Role::gyro), accel = one(import::Role::accelerometer);
  const bool enough =
      (gyro || sensors == diagnosis::Sensors::accelerometers) && (accel || sensors == diagnosis::Sensors::gyros);
  if (!enough) {
    return plain_layout(sensors);
  }
  const auto time =
      std::find_if(named.begin(), named.end(), [](const auto& c) { return c.role == import::Role::time; });
  return {time == named.end() ? 0 : static_cast<std::size_t>(time - named.begin()), gyro.value_or(Triad{}),
          accel.value_or(Triad{})};
}

// SI per unit where the names of all three say one of this quantity; 0: they do not.
double unit_of(const std::vector<import::NamedColumn>& named, const Triad& triad, import::Quantity quantity) {
  const auto unit = import::find_unit(named[triad[0]].unit);
  const bool all = unit && unit->quantity == quantity && named[triad[1]].unit == named[triad[0]].unit &&
                   named[triad[2]].unit == named[triad[0]].unit;
  return all ? unit->si : 0.0;
}

// A time that no name gives a unit is seconds, unless these make less than a sample a second and another unit makes a usual rate.
std::string time_unit(const std::string& named, double interval) {
  if (const auto unit = import::find_unit(named); unit && unit->quantity == import::Quantity::time) {
    return named;
  }
  const std::vector<std::string> units = import::time_units(interval);
  const bool seconds = units.empty() || std::find(units.begin(), units.end(), "s") != units.end();
  return seconds ? "s" : units.front();
}

// The only column that is called a temperature, from 1; 0: none.
std::size_t named_temperature(const std::vector<import::NamedColumn>& named) {
  const auto is = [](const import::NamedColumn& c) { return c.role == import::Role::temperature; };
  const auto found = std::find_if(named.begin(), named.end(), is);
  return std::count_if(named.begin(), named.end(), is) == 1 ? static_cast<std::size_t>(found - named.begin()) + 1 : 0;
}

// Of the columns that are called a time the first that is one: a date of the day stands beside the time of the day. `time` becomes it.
Expected<import::ColumnData> read_with_time(const import::ColumnSource& source,
                                            const std::vector<import::NamedColumn>& named,
                                            import::ColumnRequest request, std::size_t& time) {
  std::vector<std::size_t> candidates = {time};
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].role == import::Role::time && k != time) {
      candidates.push_back(k);
    }
  }
  std::optional<Expected<import::ColumnData>> first;
  const auto rises = [](const Expected<import::ColumnData>& data) {
    return data &&
           std::adjacent_find(data->stamps.begin(), data->stamps.end(), std::greater_equal<>()) == data->stamps.end();
  };
  for (const std::size_t candidate : candidates) {
    for (const bool date : {false, true}) {
      request.stamp = candidate;
      request.stamp_is_date = date;
      Expected<import::ColumnData> data = source.read(request);
      if (rises(data)) {
        time = candidate;
        return data;
      }
      first = first ? std::move(first) : std::move(data);
    }
  }
  return std::move(*first);
}

std::string numbers(const Triad& triad) { return fmt::format("{}, {}, {}", triad[0] + 1, triad[1] + 1, triad[2] + 1); }

std::string notes_of(const Layout& layout, const RawColumns& columns, const std::string& unit_of_time) {
  const bool gyros = columns.sensors != diagnosis::Sensors::accelerometers;
  const bool accels = columns.sensors != diagnosis::Sensors::gyros;
  const Layout plain = plain_layout(columns.sensors);
  const bool as_told = layout.time == plain.time && (!gyros || layout.gyro == plain.gyro) &&
                       (!accels || layout.accel == plain.accel) && unit_of_time == "s";
  if (as_told) {
    return {};
  }
  return fmt::format("by the names time is column {} in {}{}{}", layout.time + 1, unit_of_time,
                     gyros ? ", gyros are " + numbers(layout.gyro) : std::string(),
                     accels ? ", accelerometers " + numbers(layout.accel) : std::string());
}

}  // namespace

Expected<RawLog> read_raw_poses(const std::string& path, const RawColumns& columns) {
  const auto source = import::open_columns(path);
  if (!source) {
    return tl::unexpected(source.error());
  }
  const std::vector<import::NamedColumn> named = import::read_names((*source)->names(), (*source)->units());
  const bool both = columns.sensors == diagnosis::Sensors::both;
  const std::size_t wanted = std::max({std::size_t{both ? 7U : 4U}, columns.angle, columns.temperature});
  if (named.size() < wanted) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: {} columns, {} are needed", path, (*source)->form(), named.size(), wanted));
  }
  Layout layout = layout_of(named, columns.sensors);
  const bool gyros = columns.sensors != diagnosis::Sensors::accelerometers;
  const bool accels = columns.sensors != diagnosis::Sensors::gyros;
  import::ColumnRequest request;
  const auto ask = [&request](std::size_t column) {
    request.columns.push_back(column);
    return request.columns.size() - 1;
  };
  Triad gyro{}, accel{};
  for (std::size_t k = 0; k < 3; ++k) {
    gyro[k] = gyros ? ask(layout.gyro[k]) : 0;
    accel[k] = accels ? ask(layout.accel[k]) : 0;
  }
  const std::size_t angle = columns.angle > 0 ? ask(columns.angle - 1) : 0;
  const std::size_t thermal = columns.temperature > 0 ? columns.temperature : named_temperature(named);
  const std::size_t temperature = thermal > 0 ? ask(thermal - 1) : 0;
  const Expected<import::ColumnData> data = read_with_time(**source, named, request, layout.time);
  if (!data) {
    return tl::unexpected(data.error());
  }
  for (std::size_t k = 1; k < data->rows; ++k) {
    if (data->stamps[k] <= data->stamps[k - 1]) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}: time {} does not increase", path, data->place(k),
                                                    static_cast<double>(data->stamps[k])));
    }
  }
  RawLog log;
  diagnosis::PoseInput& input = log.input;
  input.sensors = columns.sensors;
  const double interval = data->rows < 2 ? 1.0
                                         : static_cast<double>((data->stamps.back() - data->stamps.front()) /
                                                               static_cast<long double>(data->rows - 1));
  const std::string unit = time_unit(named[layout.time].unit, interval);
  const double gyro_si = columns.raw_gyros ? 0.0 : unit_of(named, layout.gyro, import::Quantity::angular_rate);
  const double accel_si = unit_of(named, layout.accel, import::Quantity::acceleration);
  log.si = (!gyros || gyro_si > 0.0) && (!accels || accel_si > 0.0);
  input.accel_unit = accels && accel_si > 0.0 ? 1.0 : 0.0;
  log.notes = notes_of(layout, columns, unit);
  const auto long_si = static_cast<long double>(import::find_unit(unit)->si);
  // A time of the calendar in seconds leaves no digits of an interval: from the first one on.
  const bool calendar = data->rows > 0 && std::abs(static_cast<double>(data->stamps.front() * long_si)) > 1e7;
  const long double begin = calendar ? data->stamps.front() : 0.0L;
  for (std::size_t i = 0; i < data->rows; ++i) {
    input.time_s.push_back(static_cast<double>((data->stamps[i] - begin) * long_si));
    std::array<double, 3> rate{}, force{};
    for (std::size_t k = 0; k < 3; ++k) {
      rate[k] = gyros ? data->values[gyro[k]][i] * (gyro_si > 0.0 ? gyro_si : 1.0) : 0.0;
      force[k] = accels ? data->values[accel[k]][i] * (accel_si > 0.0 ? accel_si : 1.0) : 0.0;
    }
    input.gyro.push_back(rate);
    input.accel.push_back(force);
    if (thermal > 0) {
      input.temperature_c.push_back(data->values[temperature][i]);
    }
    if (columns.angle > 0) {
      input.outer.push_back(data->values[angle][i] * units::degree);
      input.inner.push_back(0.0);
    }
  }
  // A register's counts are no degrees; what the caller said stays.
  constexpr double coldest = -60.0, hottest = 150.0;
  if (columns.temperature == 0 && std::any_of(input.temperature_c.begin(), input.temperature_c.end(),
                                              [](double t) { return t < coldest || t > hottest; })) {
    input.temperature_c.clear();
  }
  return log;
}

}  // namespace selfcal::cli
