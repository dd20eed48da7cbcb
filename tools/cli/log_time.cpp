#include "tools/cli/log_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "protocol/import/guess_time.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/rows_in_turns.hpp"
#include "protocol/import/time_steps.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::cli {
namespace {

void leave_out_timeless(TimedRows& rows) {
  std::vector<bool> timeless;
  for (const long double stamp : rows.data.stamps) {
    timeless.push_back(!std::isfinite(stamp));
  }
  if (const auto count = std::count(timeless.begin(), timeless.end(), true); count > 0) {
    rows.notes =
        fmt::format("{} row{} without a time {} left out", count, count > 1 ? "s" : "", count > 1 ? "are" : "is");
  }
  import::leave_out(timeless, rows.data);
}

void take_once(TimedRows& rows) {
  const std::vector<bool> repeated = import::repeated_rows(rows.data);
  if (const auto count = std::count(repeated.begin(), repeated.end(), true); count > 0) {
    rows.notes += (rows.notes.empty() ? "" : "; ") +
                  fmt::format("{} rows are the row before once more and are taken once", count);
    import::leave_out(repeated, rows.data);
  }
}

// Error (bad_input): rows of several sensors have one stamp.
Expected<void> spread_stamps(TimedRows& rows, const import::ColumnSource& source) {
  constexpr int most = 8;
  std::vector<int> places = import::place_in_stamp(rows.data.stamps);
  const std::string words = import::spread_coarse_stamps(rows.data.stamps);
  rows.notes += (rows.notes.empty() || words.empty() ? "" : "; ") + words;
  if (!words.empty() && std::all_of(places.begin(), places.end(), [](int place) { return place < most; }) &&
      import::rows_take_turns(rows.data.values, places)) {
    return fail(ErrorKind::bad_input,
                fmt::format("rows of several sensors, one under another, with one time in {}: a file for each is read "
                            "(awk makes them)",
                            source.title(rows.time)));
  }
  return {};
}

bool rises(const std::vector<long double>& stamps) {
  return !stamps.empty() && std::adjacent_find(stamps.begin(), stamps.end(), std::greater_equal<>()) == stamps.end();
}

}  // namespace

bool holds_stamps(const import::ColumnSource& source, std::size_t column) {
  import::ColumnRequest request;
  request.stamp = column;
  request.tolerant = true;
  request.most_rows = 200;
  for (const bool date : {false, true}) {
    request.stamp_is_date = date;
    const Expected<import::ColumnData> data = source.read(request);
    if (data && std::any_of(data->stamps.begin(), data->stamps.end(), [](long double s) { return std::isfinite(s); })) {
      return true;
    }
  }
  return false;
}

Expected<TimedRows> read_with_time(const import::ColumnSource& source, std::vector<std::size_t> times,
                                   import::ColumnRequest request) {
  if (times.empty()) {
    return source.read(request).map([](import::ColumnData data) { return TimedRows{std::move(data), 0, {}}; });
  }
  import::nearest_clock_first(source.names(), times);
  std::optional<Expected<TimedRows>> first;
  for (const std::size_t candidate : times) {
    if (!holds_stamps(source, candidate) && candidate != times.back()) {
      continue;  // a column that the logger has for what it did not have
    }
    for (const bool date : {false, true}) {
      request.stamp = candidate;
      request.stamp_is_date = date;
      Expected<TimedRows> rows = source.read(request).map([&](import::ColumnData data) {
        return TimedRows{std::move(data), candidate, {}};
      });
      if (rows) {
        if (request.tolerant) {
          leave_out_timeless(*rows);
        }
        take_once(*rows);
        const std::string continued = import::continue_full_clocks(rows->data.stamps);
        rows->notes += (rows->notes.empty() || continued.empty() ? "" : "; ") + continued;
        if (rises(rows->data.stamps)) {
          return rows;
        }
        if (const std::string moved = import::put_in_order(rows->data); !moved.empty()) {
          rows->notes += (rows->notes.empty() ? "" : "; ") + moved;
          if (rises(rows->data.stamps)) {
            return rows;
          }
        }
        if (const auto spread = spread_stamps(*rows, source); !spread) {
          return tl::unexpected(spread.error());
        } else if (rises(rows->data.stamps)) {
          return rows;
        }
        if (const std::string parts = import::put_parts_behind(rows->data.stamps); !parts.empty()) {
          rows->notes += (rows->notes.empty() ? "" : "; ") + parts;
          return rows;
        }
      }
      first = first ? std::move(first) : std::move(rows);
    }
  }
  return std::move(*first);
}

Expected<std::string> time_unit(const TimedRows& rows, const import::ColumnSource& source,
                                const std::vector<import::NamedColumn>& named, const std::string& file,
                                const std::string& way_out) {
  const std::vector<long double>& stamps = rows.data.stamps;
  const double interval =
      stamps.size() < 2
          ? 1.0
          : static_cast<double>((stamps.back() - stamps.front()) / static_cast<long double>(stamps.size() - 1));
  const std::string& said = named[rows.time].unit;
  if (const auto unit = import::find_unit(said); unit && unit->quantity == import::Quantity::time) {
    return said;
  }
  if (const std::string& other = named[rows.time].other_unit; !other.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: nobody says how long one of its {} is: {}", file,
                                                  source.title(rows.time), other, way_out));
  }
  const bool xsens = source.names()[rows.time].find("SampleTimeFine") != std::string::npos;
  const std::vector<std::string> units =
      xsens ? import::xsens_time_units(interval) : import::time_units_of(stamps, interval);
  // Excel's and MATLAB's days since 1900 and since 0.
  constexpr double shortest_s = 5e-5;
  constexpr std::array<std::pair<long double, long double>, 2> days{{{25000.0L, 80000.0L}, {690000.0L, 800000.0L}}};
  if (units.empty() && interval < shortest_s && !stamps.empty()) {
    const bool in_days = std::any_of(days.begin(), days.end(), [&](const auto& range) {
      return stamps.front() > range.first && stamps.back() < range.second;
    });
    return in_days ? Expected<std::string>("d")
                   : fail(ErrorKind::bad_input,
                          fmt::format("{}: {}: intervals of {:.3g}: in s nothing samples so fast; a unit in its name "
                                      "says what it is (time_h); {}",
                                      file, source.title(rows.time), interval, way_out));
  }
  constexpr long double longest_count = 1e7L;  // s since 1970 are more
  if (units.size() > 1 && stamps.back() < longest_count && import::counts_by_one(stamps)) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {} rises by 1 from row to row: a second, or rows that are counted: {}", file,
                            source.title(rows.time), way_out));
  }
  if (units.empty() || std::find(units.begin(), units.end(), "s") != units.end()) {
    return std::string("s");
  }
  if (units.size() > 1) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}: intervals of {:.6g} are {} or {}: {}", file,
                                                  source.title(rows.time), interval, units[0], units[1], way_out));
  }
  return units.front();
}

Expected<void> check_increasing(const std::string& file, const import::ColumnData& data, const std::string& way_out) {
  for (std::size_t k = 1; k < data.rows; ++k) {
    if (data.stamps[k] <= data.stamps[k - 1]) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {}: time {:.10g} is not after {:.10g}{}", file, data.place(k),
                              static_cast<double>(data.stamps[k]), static_cast<double>(data.stamps[k - 1]), way_out));
    }
  }
  return {};
}

}  // namespace selfcal::cli
