#include "tools/cli/log_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "protocol/import/guess_units.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::cli {

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
           std::all_of(data->stamps.begin(), data->stamps.end(), [](long double s) { return std::isfinite(s); }) &&
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

std::string time_unit(const std::string& named, double interval) {
  if (const auto unit = import::find_unit(named); unit && unit->quantity == import::Quantity::time) {
    return named;
  }
  const std::vector<std::string> units = import::time_units(interval);
  const bool seconds = units.empty() || std::find(units.begin(), units.end(), "s") != units.end();
  return seconds ? "s" : units.front();
}

Expected<void> check_increasing(const std::string& path, const import::ColumnData& data) {
  for (std::size_t k = 1; k < data.rows; ++k) {
    if (data.stamps[k] <= data.stamps[k - 1]) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}: time {} does not increase", path, data.place(k),
                                                    static_cast<double>(data.stamps[k])));
    }
  }
  return {};
}

double interval_of(const import::ColumnData& data) {
  return data.rows < 2 ? 1.0
                       : static_cast<double>((data.stamps.back() - data.stamps.front()) /
                                             static_cast<long double>(data.rows - 1));
}

}  // namespace selfcal::cli
