#include "tools/cli/log_angles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "estimator/geometry/angles.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/guess_names.hpp"
#include "protocol/import/units.hpp"
#include "tools/cli/log_time.hpp"
#include "tools/cli/log_units.hpp"

namespace selfcal::cli {
namespace {

using import::NamedColumn;

Expected<std::size_t> angle_of(const import::ColumnSource& source, const std::vector<NamedColumn>& named,
                               std::size_t asked, const std::string& file) {
  if (asked > named.size()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: column {}; the file has {}", file, asked, named.size()));
  }
  if (asked > 0) {
    return asked - 1;
  }
  std::optional<std::size_t> found;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (called_angle(named[k], source.names()[k])) {
      if (found) {
        return fail(ErrorKind::bad_input, fmt::format("{}: {} and {} are both called angles: --angle-column says which",
                                                      file, source.title(*found), source.title(k)));
      }
      found = k;
    }
  }
  return found ? Expected<std::size_t>(*found)
               : fail(ErrorKind::bad_input,
                      fmt::format("{}: no column is called an angle: --angle-column says which", file));
}

struct Angles {
  std::vector<long double> time_s;
  std::vector<double> angle_rad;
};

Expected<Angles> read_angles(const std::string& file, std::size_t asked) {
  const auto source = import::open_columns(file);
  if (!source) {
    return tl::unexpected(source.error());
  }
  const std::vector<NamedColumn> named = import::read_names((*source)->names(), (*source)->units());
  const Expected<std::size_t> column = angle_of(**source, named, asked, file);
  if (!column) {
    return tl::unexpected(column.error());
  }
  std::vector<std::size_t> times;
  for (const bool called : {true, false}) {
    for (std::size_t k = 0; k < named.size(); ++k) {
      const bool time = named[k].role == import::Role::time;
      if (k != *column && time == called && (time || named[k].role == import::Role::unknown)) {
        times.push_back(k);
      }
    }
  }
  constexpr const char* no_time = "the table's file needs a time that rises";
  if (times.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", file, no_time));
  }
  import::ColumnRequest request;
  request.columns = {*column};
  Expected<TimedRows> rows = read_with_time(**source, times, request);
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  if (const auto rising = check_increasing(file, rows->data, fmt::format(": {}", no_time)); !rising) {
    return tl::unexpected(rising.error());
  }
  const Expected<std::string> unit = time_unit(*rows, **source, named, file, no_time);
  if (!unit) {
    return tl::unexpected(unit.error());
  }
  const auto si = static_cast<long double>(import::find_unit(*unit)->si);
  Angles angles{std::move(rows->data.stamps), std::move(rows->data.values[0])};
  std::for_each(angles.time_s.begin(), angles.time_s.end(), [si](long double& t) { t *= si; });
  const double rad = unit_of_angle(named[*column]);
  std::for_each(angles.angle_rad.begin(), angles.angle_rad.end(), [rad](double& a) { a *= rad; });
  angles.angle_rad = unwrapped(std::move(angles.angle_rad));
  return angles;
}

template <typename Rows>
void keep(std::size_t first, std::size_t last, Rows& rows) {
  if (!rows.empty()) {
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(last), rows.end());
    rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(first));
  }
}

}  // namespace

Expected<void> add_angles(const std::string& file, std::size_t column, const std::string& log_file, RawLog& log) {
  const Expected<Angles> angles = read_angles(file, column);
  if (!angles) {
    return tl::unexpected(angles.error());
  }
  const std::vector<long double>& from = angles->time_s;
  diagnosis::PoseInput& input = log.input;
  const auto at = [&](std::size_t row) { return static_cast<long double>(input.time_s[row]) + log.begin_s; };
  std::size_t first = 0, last = input.time_s.size();
  while (first < last && (from.empty() || at(first) < from.front())) {
    ++first;
  }
  while (last > first && at(last - 1) > from.back()) {
    --last;
  }
  if (2 * (last - first) < input.time_s.size() || from.size() < 2) {
    return fail(
        ErrorKind::bad_input,
        fmt::format("{} and {}: their times do not overlap: {:.10g} to {:.10g} s and {:.10g} to {:.10g} s", log_file,
                    file, static_cast<double>(at(0)), static_cast<double>(at(input.time_s.size() - 1)),
                    from.empty() ? 0.0 : static_cast<double>(from.front()),
                    from.empty() ? 0.0 : static_cast<double>(from.back())));
  }
  keep(first, last, input.time_s);
  keep(first, last, input.gyro);
  keep(first, last, input.accel);
  keep(first, last, input.temperature_c);
  input.outer.resize(input.time_s.size());
  input.inner.assign(input.time_s.size(), 0.0);
  std::size_t k = 1;
  for (std::size_t row = 0; row < input.time_s.size(); ++row) {
    while (k + 1 < from.size() && from[k] < at(row)) {
      ++k;
    }
    const auto share = static_cast<double>((at(row) - from[k - 1]) / (from[k] - from[k - 1]));
    input.outer[row] = (1.0 - share) * angles->angle_rad[k - 1] + share * angles->angle_rad[k];
  }
  return {};
}

}  // namespace selfcal::cli
