#include "tools/cli/read_out_columns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "estimator/geometry/units.hpp"
#include "protocol/import/guess_attitude.hpp"
#include "protocol/import/table_read_outs.hpp"
#include "protocol/import/units.hpp"
#include "tools/cli/log_units.hpp"

namespace selfcal::cli {
namespace {

using import::NamedColumn;
using import::Quantity;
using import::TableReadOut;

bool is_used(const PoseLayout& layout, std::size_t column) {
  const auto among = [column](const std::vector<std::size_t>& all) {
    return std::find(all.begin(), all.end(), column) != all.end();
  };
  return among(layout.gyro) || among(layout.accel);
}

// Numbers in all rows, which are not all the same.
bool moves(const import::ColumnSource& source, std::size_t column) {
  import::ColumnRequest request;
  request.columns = {column};
  const Expected<import::ColumnData> data = source.read(request);
  return data && data->rows > 0 &&
         std::any_of(data->values[0].begin(), data->values[0].end(),
                     [first = data->values[0].front()](double v) { return v != first; });
}

std::vector<std::size_t> columns_called(const import::ColumnSource& source, const std::vector<NamedColumn>& named,
                                        const PoseLayout& layout, TableReadOut wanted) {
  std::vector<bool> of_attitude(named.size(), false);
  for (const import::AttitudeColumns& attitude : import::attitudes_by_name(source.names(), source.units())) {
    for (const std::size_t column : attitude.columns) {
      of_attitude[column] = true;
    }
  }
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (!of_attitude[k] && !is_used(layout, k) && import::table_read_out(named[k], source.names()[k]) == wanted &&
        moves(source, k)) {
      found.push_back(k);
    }
  }
  return found;
}

double unit_of_rate(const NamedColumn& column) {
  const auto unit = import::find_unit(column.unit);
  return unit && unit->quantity == Quantity::angular_rate ? unit->si : units::degree;
}

// Outer first, where a name says which is which.
void put_in_order(const std::vector<NamedColumn>& named, std::vector<std::size_t>& axes) {
  if (axes.size() == 2 && (named[axes[0]].role == import::Role::inner || named[axes[1]].role == import::Role::outer)) {
    std::swap(axes[0], axes[1]);
  }
}

}  // namespace

Expected<ReadOutColumns> read_out_columns(const import::ColumnSource& source, const std::vector<NamedColumn>& named,
                                          const PoseLayout& layout, const RawColumns& columns,
                                          const std::string& file) {
  ReadOutColumns found;
  const std::size_t told = std::max(columns.angle, columns.turn_rate);
  if (named.size() < told) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: {} columns, {} are needed", file, source.form(), named.size(), told));
  }
  if (columns.angle > 0) {
    found.axes.push_back({columns.angle - 1, false, unit_of_angle(named[columns.angle - 1])});
    return found;
  }
  if (columns.turn_rate > 0) {
    found.axes.push_back({columns.turn_rate - 1, true, unit_of_rate(named[columns.turn_rate - 1])});
    return found;
  }
  if (!columns.table_by_names || layout.sensors == diagnosis::Sensors::accelerometers) {
    return found;
  }
  std::vector<std::size_t> axes = columns_called(source, named, layout, TableReadOut::angle);
  const bool rates = axes.empty();
  if (rates) {
    axes = columns_called(source, named, layout, TableReadOut::rate);
  }
  std::vector<std::string> titles;
  titles.reserve(axes.size());
  for (const std::size_t column : axes) {
    titles.push_back(source.title(column));
  }
  const char* option = rates ? "--rate-column" : "--angle-column";
  const std::string which = fmt::format("{}", fmt::join(titles, ", "));
  if (axes.size() > 2) {
    found.notes = fmt::format("{} may all be a table's: none is taken; {} says which", which, option);
    return found;
  }
  put_in_order(named, axes);
  for (const std::size_t column : axes) {
    found.axes.push_back({column, rates, rates ? unit_of_rate(named[column]) : unit_of_angle(named[column])});
  }
  if (!axes.empty()) {
    const std::string what = rates ? "rate, added up" : "angle";
    found.notes =
        axes.size() == 1
            ? fmt::format("by its name {} is a table's {}; {} 0 leaves it alone", which, what, option)
            : fmt::format("by their names {} are a table's, {} of each; {} 0 leaves them alone", which, what, option);
  }
  return found;
}

std::vector<double> read_out_angles(const ReadOutColumn& axis, const std::vector<double>& values,
                                    const std::vector<double>& time_s) {
  std::vector<double> angles = axis.is_rate ? import::angle_of_rate(values, time_s) : values;
  std::for_each(angles.begin(), angles.end(), [si = axis.si](double& angle) { angle *= si; });
  return angles;
}

}  // namespace selfcal::cli
