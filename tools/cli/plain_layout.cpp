#include "tools/cli/plain_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocol/import/median.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Sensors;

// The first column, or the last one where that rises and the first does not: PSINS writes the time behind its sensors.
std::size_t nameless_time(const import::ColumnSource& source, const std::vector<std::size_t>& numeric) {
  const auto rises = [&](std::size_t column) {
    import::ColumnRequest request;
    request.tolerant = true;
    request.columns = {column};
    request.most_rows = 1000;
    const Expected<import::ColumnData> data = source.read(request);
    const auto falls = [](double a, double b) { return !(b > a); };
    return data && std::adjacent_find(data->values[0].begin(), data->values[0].end(), falls) == data->values[0].end();
  };
  return !rises(numeric.front()) && rises(numeric.back()) ? numeric.size() - 1 : 0;
}

// Columns that hold a number in the first rows: a sentence's "$IMU", a status word and labels of positions are none.
std::vector<std::size_t> numeric_columns(const import::ColumnSource& source) {
  std::vector<std::size_t> numeric;
  numeric.reserve(source.names().size());
  for (std::size_t column = 0; column < source.names().size(); ++column) {
    import::ColumnRequest request;
    request.tolerant = true;
    request.columns = {column};
    request.stamp = column;
    request.stamp_is_date = true;
    request.most_rows = 100;
    const Expected<import::ColumnData> data = source.read(request);
    const auto finite = [](auto v) { return std::isfinite(v); };
    if (!data || std::any_of(data->values[0].begin(), data->values[0].end(), finite) ||
        std::any_of(data->stamps.begin(), data->stamps.end(), finite)) {
      numeric.push_back(column);
    }
  }
  return numeric;
}

// How much the size of a triad differs from row to row: the median of what it is off by, over its median.
double spread_of_size(const std::vector<std::vector<double>>& values, std::size_t first) {
  std::vector<double> sizes;
  sizes.reserve(values[first].size());
  for (std::size_t row = 0; row < values[first].size(); ++row) {
    const double size = std::hypot(values[first][row], values[first + 1][row], values[first + 2][row]);
    if (std::isfinite(size)) {
      sizes.push_back(size);
    }
  }
  const double middle = sizes.empty() ? 0.0 : import::median(sizes);
  std::for_each(sizes.begin(), sizes.end(), [middle](double& size) { size = std::abs(size - middle); });
  return middle > 0.0 ? import::median(std::move(sizes)) / middle : HUGE_VAL;
}

// Whether gravity stands in the first of two triads, whose size then hardly changes, and not in the second.
bool gravity_is_first(const import::ColumnSource& source, const std::vector<std::size_t>& six) {
  import::ColumnRequest request;
  request.tolerant = true;
  request.columns = six;
  request.most_rows = 200000;
  const Expected<import::ColumnData> data = source.read(request);
  constexpr double hardly = 0.05, times = 10.0;
  if (!data) {
    return false;
  }
  const double first = spread_of_size(data->values, 0), second = spread_of_size(data->values, 3);
  return first < hardly && second > times * first;
}

}  // namespace

Expected<PoseLayout> plain_layout(const import::ColumnSource& source, Sensors sensors, const RawColumns& columns,
                                  const std::string& file) {
  const std::vector<std::size_t> numeric = numeric_columns(source);
  const std::size_t count = numeric.size();
  const bool both = sensors == Sensors::both;
  const std::size_t wanted = both ? 6 : 3;
  PoseLayout layout;
  layout.sensors = sensors;
  std::size_t time = columns.rate_hz && (count == wanted || count == 1) ? 0 : 1;
  if (!columns.rate_hz) {
    const std::size_t where = count == wanted + 1 ? nameless_time(source, numeric) : 0;
    layout.times = {count > 0 ? numeric[where] : 0};
    time = where == 0 ? 1 : 0;
  }
  if (sensors == Sensors::gyros && (count == time + 1 || count == columns.angle) && count < time + wanted) {
    layout.gyro = {numeric[time]};
    layout.only_axis = 0;
    return layout;
  }
  if (count == 1) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: one column: --only gyros takes it for one gyro's, and --rate says "
                            "how many rows a second it holds",
                            file));
  }
  if (count < time + wanted) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: {} columns, {} are needed{}", file, source.form(), count, time + wanted,
                            both         ? "; of a log of one sensor --only gyros or --only accelerometers says which"
                            : count == 2 ? "; --angle-column says which of two is the angle of a dividing head"
                                         : ""));
  }
  const std::size_t told = (columns.angle > 0 ? 1 : 0) + (columns.temperature > 0 ? 1 : 0) + 1;  // and a counter, say
  if (count > time + wanted + told) {
    return fail(
        ErrorKind::bad_input,
        fmt::format("{}: {}: {} columns without names: `selfcal import --guess` looks for the sensors among them", file,
                    source.form(), count));
  }
  const auto of = [&numeric](std::size_t first) {
    return std::vector<std::size_t>{numeric[first], numeric[first + 1], numeric[first + 2]};
  };
  if (sensors != Sensors::accelerometers) {
    layout.gyro = of(time);
  }
  if (sensors != Sensors::gyros) {
    layout.accel = of(time + (both ? 3 : 0));
  }
  if (both) {
    std::vector<std::size_t> six = layout.gyro;
    six.insert(six.end(), layout.accel.begin(), layout.accel.end());
    if (gravity_is_first(source, six)) {
      std::swap(layout.gyro, layout.accel);
    }
  }
  return layout;
}

}  // namespace selfcal::cli
