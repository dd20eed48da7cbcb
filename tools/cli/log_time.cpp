#include "tools/cli/log_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "protocol/import/guess_time.hpp"
#include "protocol/import/guess_units.hpp"
#include "protocol/import/incomplete_rows.hpp"
#include "protocol/import/rows_in_turns.hpp"
#include "protocol/import/time_steps.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::cli {
namespace {

void leave_out_timeless(import::ColumnData& data) {
  std::vector<bool> timeless;
  for (const long double stamp : data.stamps) {
    timeless.push_back(!std::isfinite(stamp));
  }
  import::leave_out(timeless, data);
}

void take_once(TimedRows& rows) {
  const std::vector<bool> repeated = import::repeated_rows(rows.data);
  if (const auto count = std::count(repeated.begin(), repeated.end(), true); count > 0) {
    rows.notes = fmt::format("{} rows are the row before once more and are taken once", count);
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

// Rows that came by a network, a few of them by another way than those before: put in the order of their stamps where one in fifty and fewer stands
// up to eight rows behind its place. Empty: nothing done.
std::string put_in_order(import::ColumnData& data) {
  constexpr std::size_t one_in = 50, farthest = 8;
  std::size_t falls = 0;
  for (std::size_t k = 1; k < data.stamps.size(); ++k) {
    falls += data.stamps[k] < data.stamps[k - 1] ? 1 : 0;
  }
  if (falls == 0 || falls * one_in > data.stamps.size()) {
    return {};
  }
  std::vector<std::size_t> order(data.stamps.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return data.stamps[a] < data.stamps[b]; });
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (order[k] > k + farthest || k > order[k] + farthest) {
      return {};
    }
  }
  const auto ordered = [&order](auto& all) {
    auto moved = all;
    std::transform(order.begin(), order.end(), moved.begin(), [&all](std::size_t from) { return all[from]; });
    all = std::move(moved);
  };
  ordered(data.stamps);
  std::for_each(data.values.begin(), data.values.end(), ordered);
  return fmt::format("{} rows stand behind later ones: put in the order of their times", falls);
}

bool rises(const std::vector<long double>& stamps) {
  return !stamps.empty() && std::adjacent_find(stamps.begin(), stamps.end(), std::greater_equal<>()) == stamps.end();
}

// Seconds in one column and the part of a second in the next.
std::optional<TimedRows> read_split(const import::ColumnSource& source, const SplitTime& split,
                                    import::ColumnRequest request) {
  request.stamp = split.seconds;
  request.columns.push_back(split.part);
  Expected<import::ColumnData> data = source.read(request);
  if (!data) {
    return std::nullopt;
  }
  const std::vector<double> part = std::move(data->values.back());
  data->values.pop_back();
  for (std::size_t k = 0; k < part.size(); ++k) {
    if (!(part[k] >= 0.0 && part[k] * split.part_s < 1.0)) {
      return std::nullopt;
    }
    data->stamps[k] += static_cast<long double>(part[k]) * static_cast<long double>(split.part_s);
  }
  TimedRows rows{
      std::move(*data), split.seconds,
      fmt::format("time is {} with the part of a second in {}", source.title(split.seconds), source.title(split.part))};
  take_once(rows);
  const std::string moved = put_in_order(rows.data);
  rows.notes += (moved.empty() ? "" : "; ") + moved;
  return rises(rows.data.stamps) ? std::optional(std::move(rows)) : std::nullopt;
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

std::optional<SplitTime> split_time(const import::ColumnSource& source) {
  const std::vector<std::string>& names = source.names();
  const auto letters = [](const std::string& name) {
    std::string text;
    for (const char c : name) {
      text += std::isalpha(static_cast<unsigned char>(c)) != 0
                  ? std::string(1, static_cast<char>(std::tolower(static_cast<unsigned char>(c))))
                  : std::string();
    }
    return text;
  };
  const auto ends_with_any = [](const std::string& text, std::initializer_list<const char*> endings) {
    return std::any_of(endings.begin(), endings.end(), [&](const char* e) { return text.ends_with(e); });
  };
  for (std::size_t k = 0; k + 1 < names.size(); ++k) {
    const std::string first = letters(names[k]), second = letters(names[k + 1]);
    const bool nano = ends_with_any(second, {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"});
    const bool micro = ends_with_any(second, {"usec", "usecs", "microsec", "microsecs", "microseconds"});
    if ((nano || micro) && ends_with_any(first, {"sec", "secs", "seconds", "unixtime"}) &&
        !ends_with_any(first, {"nsec", "nsecs", "usec", "usecs", "msec", "msecs", "nanoseconds", "microseconds",
                               "milliseconds"})) {
      return SplitTime{k, k + 1, nano ? 1e-9 : 1e-6};
    }
  }
  return std::nullopt;
}

Expected<TimedRows> read_with_time(const import::ColumnSource& source, const std::vector<std::size_t>& times,
                                   import::ColumnRequest request) {
  if (times.empty()) {
    return source.read(request).map([](import::ColumnData data) { return TimedRows{std::move(data), 0, {}}; });
  }
  if (const std::optional<SplitTime> split = split_time(source)) {
    if (std::optional<TimedRows> rows = read_split(source, *split, request)) {
      return std::move(*rows);
    }
  }
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
          leave_out_timeless(rows->data);
        }
        take_once(*rows);
        const std::string continued = import::continue_full_clocks(rows->data.stamps);
        rows->notes += (rows->notes.empty() || continued.empty() ? "" : "; ") + continued;
        if (rises(rows->data.stamps)) {
          return rows;
        }
        if (const std::string moved = put_in_order(rows->data); !moved.empty()) {
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
  const bool xsens = source.names()[rows.time].find("SampleTimeFine") != std::string::npos;
  const std::vector<std::string> units = xsens ? import::xsens_time_units(interval) : import::time_units(interval);
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
