#include "protocol/import/time_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>

#include "protocol/import/incomplete_rows.hpp"

namespace selfcal::import {
namespace {

constexpr std::array<long double, 7> full = {65536.0L,  16777216.0L, 4294967296.0L, 86400.0L,
                                             604800.0L, 86400000.0L, 604800000.0L};

// Whether a column rises from row to row but where rows repeat.
bool has_a_clock(const ColumnData& data, const std::vector<bool>& repeated) {
  constexpr std::size_t most_falls = 100;  // of a clock that begins again: one in as many rows
  return std::any_of(data.values.begin(), data.values.end(), [&](const std::vector<double>& v) {
    std::size_t falls = 0;
    for (std::size_t row = 1; row < v.size(); ++row) {
      falls += v[row] > v[row - 1] || repeated[row] ? 0 : 1;
    }
    return falls * most_falls <= v.size();
  });
}

// The first row of each time.
std::vector<std::size_t> first_of_stamps(const std::vector<long double>& stamps) {
  std::vector<std::size_t> firsts;
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    if (k == 0 || stamps[k] != stamps[k - 1]) {
      firsts.push_back(k);
    }
  }
  return firsts;
}

// Of a clock much coarser than the rows: how many rows a time has, and how far it is to the next one. Nothing where the rows of a time, but for the
// first and the last one, are not alike.
struct Ticks {
  std::size_t rows = 0;
  long double length = 0.0L;
};
std::optional<Ticks> even_ticks(const std::vector<long double>& stamps, const std::vector<std::size_t>& firsts) {
  constexpr std::size_t few = 3, least = 4;
  constexpr double alike = 0.1;
  if (firsts.size() < least) {
    return std::nullopt;
  }
  std::vector<std::size_t> rows;
  std::vector<long double> times;
  for (std::size_t k = 0; k < firsts.size(); ++k) {
    times.push_back(stamps[firsts[k]]);
    if (k > 0 && k + 1 < firsts.size()) {
      rows.push_back(firsts[k + 1] - firsts[k]);
    }
  }
  std::vector<std::size_t> sorted = rows;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t usual = sorted[sorted.size() / 2];
  const auto other = std::count_if(rows.begin(), rows.end(), [&](std::size_t n) {
    return std::abs(static_cast<double>(n) - static_cast<double>(usual)) > alike * static_cast<double>(usual);
  });
  constexpr std::size_t one_in = 20;  // seconds of which rows were lost
  if (usual < few || static_cast<std::size_t>(other) * one_in > rows.size()) {
    return std::nullopt;
  }
  return Ticks{usual, median_interval(times)};
}

// The row at which the second of two ticks with one stamp begins, where one tick alone has twice the rows: a leap second of a clock that shows
// whole ones.
std::optional<std::size_t> second_of_two(const std::vector<long double>& stamps, const std::vector<std::size_t>& firsts,
                                         const Ticks& ticks) {
  constexpr double alike = 0.1;
  std::optional<std::size_t> found;
  for (std::size_t k = 1; k + 1 < firsts.size(); ++k) {
    const std::size_t rows = firsts[k + 1] - firsts[k];
    const bool twice = std::abs(static_cast<double>(rows) - 2.0 * static_cast<double>(ticks.rows)) <=
                       alike * static_cast<double>(ticks.rows);
    const long double length = stamps[firsts[k + 1]] - stamps[firsts[k]];
    if (twice && std::abs(length - ticks.length) < 0.1L * ticks.length) {
      if (found) {
        return std::nullopt;
      }
      found = firsts[k] + rows / 2;
    }
  }
  return found;
}

}  // namespace

long double median_interval(const std::vector<long double>& stamps) {
  std::vector<long double> intervals;
  intervals.reserve(stamps.size());
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    intervals.push_back(stamps[k] - stamps[k - 1]);
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

namespace {

// Of those that are none: a clock coarser than the rows stands still in most of them.
long double median_step(const std::vector<long double>& stamps) {
  std::vector<long double> steps;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    if (stamps[k] > stamps[k - 1]) {
      steps.push_back(stamps[k] - stamps[k - 1]);
    }
  }
  if (steps.empty()) {
    return 0.0L;
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// Where the only fall is by a second less an interval: a second stands twice, as a leap second does in UTC, and its rows go on.
std::string continue_repeated_second(std::vector<long double>& stamps) {
  constexpr std::array<long double, 4> seconds{1.0L, 1e3L, 1e6L, 1e9L};  // in s, ms, us, ns
  constexpr long double slowest = 0.2L, fastest = 5e-5L, about = 0.5L;   // intervals, s
  const long double usual = median_step(stamps);
  const auto* const second = std::find_if(
      seconds.begin(), seconds.end(), [usual](long double s) { return usual <= slowest * s && usual >= fastest * s; });
  const auto falls = [](long double a, long double b) { return b < a; };
  const auto fall = std::adjacent_find(stamps.begin(), stamps.end(), falls);
  if (second == seconds.end() || fall == stamps.end() ||
      std::adjacent_find(std::next(fall), stamps.end(), falls) != stamps.end() ||
      std::abs(*std::next(fall) + *second - *fall - usual) > about * usual) {
    return {};
  }
  std::string words = fmt::format("a second stands twice, from {:.10g} to {:.10g}, as a leap second does: continued",
                                  static_cast<double>(*fall), static_cast<double>(*std::next(fall)));
  std::for_each(std::next(fall), stamps.end(), [second](long double& s) { s += *second; });
  return words;
}

}  // namespace

std::string continue_full_clocks(std::vector<long double>& stamps) {
  if (stamps.size() < 3) {
    return {};
  }
  const long double usual = median_step(stamps);
  constexpr long double most_lost = 20.0L;  // rows that may lack where it begins again
  long double added = 0.0L, before = stamps.front();
  std::size_t places = 0;
  std::string words;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    const long double stamp = stamps[k];
    const auto* const end = std::find_if(full.begin(), full.end(), [&](long double size) {
      const long double step = stamp + size - before;
      const long double end_zone = std::min(most_lost * usual, 0.01L * size);
      const bool near_end = stamp < end_zone && size - before < end_zone;
      return stamp < before && before < size + usual && step > 0.5L * usual && (step < 1.5L * usual || near_end);
    });
    if (usual > 0.0L && end != full.end()) {
      added += *end;
      if (++places == 1) {
        words = fmt::format("the clock begins again from {:.10g} to {:.10g}, full at {:.10g}: continued",
                            static_cast<double>(before), static_cast<double>(stamp), static_cast<double>(*end));
      }
    }
    before = stamp;
    stamps[k] = stamp + added;
  }
  words += places > 1 ? fmt::format(", so in {} places", places) : "";
  const std::string twice = continue_repeated_second(stamps);
  return words + (words.empty() || twice.empty() ? "" : "; ") + twice;
}

std::vector<int> place_in_stamp(const std::vector<long double>& stamps) {
  std::vector<int> places(stamps.size(), 0);
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    places[k] = stamps[k] == stamps[k - 1] ? places[k - 1] + 1 : 0;
  }
  return places;
}

std::string spread_coarse_stamps(std::vector<long double>& stamps) {
  if (stamps.size() < 3 || !std::is_sorted(stamps.begin(), stamps.end()) || !(stamps.back() > stamps.front())) {
    return {};
  }
  // Of a clock that stops nobody knows where its rows belong; one that shows whole seconds has as many rows in each.
  constexpr std::size_t longest = 64;
  constexpr long double usual_times = 3.0L;
  const long double interval = (stamps.back() - stamps.front()) / static_cast<long double>(stamps.size() - 1);
  std::vector<std::size_t> firsts = first_of_stamps(stamps);
  const std::optional<Ticks> ticks = even_ticks(stamps, firsts);
  const auto twice = ticks ? second_of_two(stamps, firsts, *ticks) : std::nullopt;
  if (twice) {
    std::for_each(stamps.begin() + static_cast<std::ptrdiff_t>(*twice), stamps.end(),
                  [&ticks](long double& s) { s += ticks->length; });
    firsts = first_of_stamps(stamps);
  }
  std::vector<long double> spread = stamps;
  for (std::size_t k = 0; k < firsts.size(); ++k) {
    const std::size_t first = firsts[k], next = k + 1 < firsts.size() ? firsts[k + 1] : stamps.size();
    const std::size_t rows = next - first;
    const bool last = next == stamps.size();
    long double step = last ? interval : (stamps[next] - stamps[first]) / static_cast<long double>(rows);
    long double begin = stamps[first];
    if (ticks && (k == 0 || last || stamps[next] - stamps[first] > 1.5L * ticks->length)) {
      step = ticks->length / static_cast<long double>(std::max(ticks->rows, rows));
      begin = k == 0 && !last ? stamps[first] + ticks->length - static_cast<long double>(rows) * step : begin;
    } else if ((rows > longest && !ticks) || (rows > 1 && step > usual_times * interval)) {
      return {};
    }
    for (std::size_t row = first; row < next; ++row) {
      spread[row] = begin + static_cast<long double>(row - first) * step;
    }
  }
  constexpr std::size_t one_in = 100;  // a single stamp that stands twice is a fault of the file
  const std::size_t still = stamps.size() - firsts.size();
  if (still * one_in < stamps.size()) {
    return {};
  }
  stamps = std::move(spread);
  return fmt::format("{} rows have the time of the row before, of a clock coarser than the rows: spread evenly{}",
                     still,
                     twice ? ", one time for two, which stands in twice as many rows, as a leap second does" : "");
}

std::string put_parts_behind(std::vector<long double>& stamps) {
  std::vector<std::size_t> begins;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    if (stamps[k] < stamps[k - 1]) {
      begins.push_back(k);
    }
  }
  if (begins.empty() || stamps.size() < 3) {
    return {};
  }
  constexpr std::size_t least = 50;                     // rows
  constexpr long double near = 10.0L, apart = 6000.0L;  // usual intervals
  const long double usual = median_interval(stamps);
  std::size_t before = 0, unlike = 0;
  for (std::size_t k = 0; k <= begins.size(); ++k) {
    const std::size_t begin = k == 0 ? 0 : begins[k - 1], end = k < begins.size() ? begins[k] : stamps.size();
    if (end - begin < least || std::abs(stamps[begin] - stamps.front()) > near * usual || !(usual > 0.0L)) {
      return {};
    }
    unlike += k > 0 && end - begin != before ? 1 : 0;
    before = end - begin;
  }
  if (begins.size() == 1 && unlike == 0) {
    return {};  // two sensors, one under another
  }
  long double added = 0.0L, last = stamps.front();
  auto begin = begins.begin();
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    if (begin != begins.end() && *begin == k) {
      added = last + apart * usual - stamps[k];
      ++begin;
    }
    stamps[k] += added;
    last = stamps[k];
  }
  return fmt::format("the time begins anew {} time{}: parts one after the other, a gap between them", begins.size(),
                     begins.size() == 1 ? "" : "s");
}

std::string put_in_order(ColumnData& data) {
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

std::string put_in_order(std::vector<long double>& stamps) {
  ColumnData alone;
  alone.rows = stamps.size();
  alone.stamps = std::move(stamps);
  std::string words = put_in_order(alone);
  stamps = std::move(alone.stamps);
  return words;
}

std::vector<bool> repeated_rows(const ColumnData& data) {
  std::vector<bool> repeated(data.rows, false);
  std::size_t count = 0;
  for (std::size_t row = 1; row < data.rows; ++row) {
    const bool same = (data.stamps.empty() || data.stamps[row] == data.stamps[row - 1]) &&
                      std::all_of(data.values.begin(), data.values.end(),
                                  [row](const std::vector<double>& v) { return v[row] == v[row - 1]; });
    repeated[row] = same;
    count += same ? 1 : 0;
  }
  constexpr std::size_t most = 10;
  return most * count > data.rows ? std::vector<bool>(data.rows, false) : repeated;
}

LeftOutRows rows_to_leave_out(const ColumnData& data, double most_incomplete) {
  LeftOutRows lost{incomplete_rows(data, most_incomplete), 0, 0};
  lost.incomplete = std::count(lost.rows.begin(), lost.rows.end(), true);
  if (const std::vector<bool> repeated = repeated_rows(data); has_a_clock(data, repeated)) {
    lost.repeated = std::count(repeated.begin(), repeated.end(), true);
    std::transform(lost.rows.begin(), lost.rows.end(), repeated.begin(), lost.rows.begin(), std::logical_or<>());
  }
  return lost;
}

}  // namespace selfcal::import
