#include "tools/cli/plain_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "protocol/import/median.hpp"

namespace selfcal::cli {
namespace {

using diagnosis::Sensors;

using Columns = std::vector<std::size_t>;

bool rises(const import::ColumnSource& source, std::size_t column) {
  import::ColumnRequest request;
  request.tolerant = true;
  request.columns = {column};
  request.most_rows = 1000;
  const Expected<import::ColumnData> data = source.read(request);
  const auto falls = [](double a, double b) { return !(b > a); };
  return data && std::adjacent_find(data->values[0].begin(), data->values[0].end(), falls) == data->values[0].end();
}

// Columns that hold a number in the first rows: a sentence's "$IMU", a status word and labels of positions are none. Without those that the
// caller or a name says to be something else.
Columns numeric_columns(const import::ColumnSource& source, const std::vector<import::NamedColumn>& named,
                        const RawColumns& told) {
  Columns numeric;
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
    const bool other = column + 1 == told.angle || column + 1 == told.turn_rate || column + 1 == told.temperature ||
                       named[column].role == import::Role::temperature;
    if (!other && (!data || std::any_of(data->values[0].begin(), data->values[0].end(), finite) ||
                   std::any_of(data->stamps.begin(), data->stamps.end(), finite))) {
      numeric.push_back(column);
    }
  }
  return numeric;
}

double deviation_of(std::vector<double> values, double middle) {
  std::for_each(values.begin(), values.end(), [middle](double& v) { v = std::abs(v - middle); });
  return import::median(std::move(values));
}

// Three columns side by side, as they are if they are accelerometers'.
struct Size {
  double spread =
      HUGE_VAL;  // how much its size differs from row to row: the median of what it is off by, over its median
  // In the tenth of the rows in which its components are farthest from their medians: by how much, over what its size is off by there.
  double turned = 0.0;
};

Size size_of(const std::vector<std::vector<double>>& values, std::size_t first) {
  struct Row {
    std::array<double, 3> v{};
    double size = 0.0, off = 0.0;
  };
  std::vector<Row> rows;
  std::vector<double> sizes;
  std::array<std::vector<double>, 3> parts;
  for (std::size_t i = 0; i < values[first].size(); ++i) {
    const Row row{{values[first][i], values[first + 1][i], values[first + 2][i]},
                  std::hypot(values[first][i], values[first + 1][i], values[first + 2][i])};
    if (std::isfinite(row.size)) {
      rows.push_back(row);
      sizes.push_back(row.size);
      for (std::size_t k = 0; k < parts.size(); ++k) {
        parts[k].push_back(row.v[k]);
      }
    }
  }
  const double middle = sizes.empty() ? 0.0 : import::median(sizes);
  if (!(middle > 0.0)) {
    return {};
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const double usual = import::median(std::move(parts[k]));
    for (Row& row : rows) {
      row.off = std::max(row.off, std::abs(row.v[k] - usual));
    }
  }
  constexpr std::size_t of_a_tenth = 10;
  const auto last = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() / of_a_tenth + 1);
  std::nth_element(rows.begin(), last - 1, rows.end(), [](const Row& a, const Row& b) { return a.off > b.off; });
  std::vector<double> of_parts, of_size;
  for (auto row = rows.begin(); row != last; ++row) {
    of_parts.push_back(row->off);
    of_size.push_back(std::abs(row->size - middle));
  }
  const double off = deviation_of(std::move(sizes), middle);
  const double there = std::max(off, import::median(std::move(of_size)));
  return {off / middle, there > 0.0 ? import::median(std::move(of_parts)) / there : 0.0};
}

// Whether gravity stands in the first of two triads and not in the second. Turned it keeps its size while its components change; at rest
// its size hardly changes, beside that of what stands about zero.
bool holds_gravity(const Size& one, const Size& other) {
  constexpr double hardly = 0.05, times = 10.0, turned = 20.0;
  const bool by_turns = one.turned > turned && one.turned > times * other.turned;
  return one.spread < hardly && (other.spread > times * one.spread || by_turns);
}

// Of six columns, or of seven of which one is another's: the last, or the one between accelerometers and gyros, as registers stand in
// InvenSense's; that which changes least beside its size, as a temperature does. None: the numbers do not tell.
struct Six {
  Columns gyro, accel;
};

std::optional<Six> six_of(const import::ColumnSource& source, const Columns& columns) {
  import::ColumnRequest request;
  request.tolerant = true;
  request.columns = columns;
  request.most_rows = 200000;
  const Expected<import::ColumnData> data = source.read(request);
  if (!data) {
    return std::nullopt;
  }
  const auto triad = [&columns](std::size_t first) {
    return Columns{columns[first], columns[first + 1], columns[first + 2]};
  };
  const Size front = size_of(data->values, 0), next = size_of(data->values, 3);
  const auto arranged = [&](std::size_t second, const Size& behind) -> std::optional<Six> {
    if (holds_gravity(front, behind)) {
      return Six{triad(second), triad(0)};
    }
    // Gyros come before accelerometers without anything between them.
    return second == 3 && holds_gravity(behind, front) ? std::optional(Six{triad(0), triad(second)}) : std::nullopt;
  };
  if (columns.size() == 6) {
    return arranged(3, next);
  }
  const std::optional<Six> last = arranged(3, next), between = arranged(4, size_of(data->values, 4));
  const auto change = [&data](std::size_t column) {
    std::vector<double> values = data->values[column];
    std::erase_if(values, [](double v) { return !std::isfinite(v); });
    const double middle = values.empty() ? 0.0 : import::median(values);
    return middle != 0.0 ? deviation_of(std::move(values), middle) / std::abs(middle) : HUGE_VAL;
  };
  return last && between ? (change(3) < change(6) ? between : last) : last ? last : between;
}

constexpr const char* say_which = "--gyro-columns and --accelerometer-columns say which are the sensors";

}  // namespace

Expected<PoseLayout> plain_layout(const import::ColumnSource& source, const std::vector<import::NamedColumn>& named,
                                  Sensors sensors, const RawColumns& columns, const std::string& file) {
  Columns numeric = numeric_columns(source, named, columns);
  const std::size_t count = numeric.size();
  const bool both = sensors == Sensors::both;
  const std::size_t wanted = both ? 6 : 3;
  PoseLayout layout;
  layout.sensors = sensors;
  const auto take = [&numeric](std::size_t where) {
    const std::size_t column = numeric[where];
    numeric.erase(numeric.begin() + static_cast<std::ptrdiff_t>(where));
    return column;
  };
  if (columns.rate_hz) {
    if (count > wanted && rises(source, numeric.front())) {
      take(0);  // a counter
    }
  } else if (count > 0) {
    // PSINS writes the time behind its sensors; whose they are stands before it in phones' logs.
    const std::size_t second = count > wanted + 1 ? 1 : 0;
    const std::size_t where = rises(source, numeric.front())                         ? 0
                              : rises(source, numeric[second])                       ? second
                              : count == wanted + 1 && rises(source, numeric.back()) ? count - 1
                                                                                     : 0;
    layout.times = {take(where)};
    numeric.erase(numeric.begin(), numeric.begin() + static_cast<std::ptrdiff_t>(where == second ? where : 0));
  } else {
    layout.times = {0};
  }
  if (sensors == Sensors::gyros && numeric.size() == 1) {
    layout.gyro = numeric;
    layout.only_axis = 0;
    return layout;
  }
  if (count == 1) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: one column: --only gyros takes it for one gyro's, and --rate says "
                            "how many rows a second it holds",
                            file));
  }
  if (numeric.size() < wanted) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: {} columns, {} are needed{}", file, source.form(), count,
                            (columns.rate_hz ? 0 : 1) + wanted,
                            both         ? "; of a log of one sensor --only gyros or --only accelerometers says which"
                            : count == 2 ? "; --angle-column says which of two is the angle of a dividing head"
                                         : ""));
  }
  if (numeric.size() > wanted + 1) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: {} columns without names that are known: {}; `selfcal "
                                                  "import --guess` looks for them by what they do",
                                                  file, source.form(), count, say_which));
  }
  if (!both) {
    (sensors == Sensors::gyros ? layout.gyro : layout.accel) = {numeric[0], numeric[1], numeric[2]};
    return layout;
  }
  std::optional<Six> six = six_of(source, numeric);
  if (!six && numeric.size() > wanted) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: which of {} columns are gyros and which accelerometers "
                                                  "the numbers do not tell: {}",
                                                  file, source.form(), count, say_which));
  }
  if (!six) {
    six = Six{{numeric[0], numeric[1], numeric[2]}, {numeric[3], numeric[4], numeric[5]}};
  }
  layout.gyro = std::move(six->gyro);
  layout.accel = std::move(six->accel);
  return layout;
}

}  // namespace selfcal::cli
