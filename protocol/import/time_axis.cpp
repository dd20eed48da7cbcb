#include "protocol/import/time_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/import/time_steps.hpp"
#include "protocol/import/units.hpp"

namespace selfcal::import {
namespace {

constexpr long double gap_intervals = 1.5L;  // as the check of a recording has it

// How finely stamps are written: the largest power of ten that all of the first ones are multiples of.
long double resolution_of(const std::vector<long double>& stamps) {
  constexpr std::size_t looked_at = 1000;
  for (int power = 2; power >= -9; --power) {
    const long double step = std::pow(10.0L, power);
    const bool all =
        std::all_of(stamps.begin(), stamps.begin() + static_cast<std::ptrdiff_t>(std::min(stamps.size(), looked_at)),
                    [&](long double s) {
                      const long double steps = s / step;
                      return std::abs(steps - std::round(steps)) < 1e-4L;
                    });
    if (all) {
      return step;
    }
  }
  return 0.0L;
}

// The number with fewest digits within TOLERANCE (relative) of VALUE.
double shortest_near(double value, double tolerance) {
  for (int digits = 1; digits < 16; ++digits) {
    const double scale = std::pow(10.0, digits - 1 - static_cast<int>(std::floor(std::log10(value))));
    const double rounded = std::round(value * scale) / scale;
    if (std::abs(rounded / value - 1.0) <= tolerance) {
      return rounded;
    }
  }
  return value;
}

// Whether rows are missing before stamp k: those behind it stand half an interval later beside those before it than they would. A row that was
// late alone, as a computer writes it down, is followed by short intervals.
bool is_gap(const std::vector<long double>& stamps, std::size_t k, long double typical) {
  if (stamps[k] - stamps[k - 1] <= gap_intervals * typical) {
    return false;
  }
  constexpr std::size_t around = 10;
  const auto place = [&](std::size_t first, std::size_t last) {
    std::vector<long double> off;
    for (std::size_t i = first; i < last; ++i) {
      off.push_back(stamps[i] - typical * static_cast<long double>(i));
    }
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
    return off[off.size() / 2];
  };
  const std::size_t before = k - std::min(k, around), behind = std::min(stamps.size(), k + around);
  return place(k, behind) - place(before, k) > (gap_intervals - 1.0L) * typical;
}

}  // namespace

RateOfStamps rate_of(const std::vector<long double>& stamps, long double seconds) {
  RateOfStamps found;
  if (stamps.size() < 2) {
    return found;
  }
  const long double typical = median_interval(stamps);
  if (!(typical > 0.0L)) {
    return found;
  }
  long double span = 0.0L;
  std::size_t count = 0;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    const long double interval = stamps[k] - stamps[k - 1];
    if (is_gap(stamps, k, typical)) {
      ++found.gaps;
    } else {
      span += interval;
      ++count;
    }
  }
  const long double mean = span / static_cast<long double>(count);
  long double squares = 0.0L;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    const long double off = (stamps[k] - stamps[k - 1]) / mean - 1.0L;
    squares += off < gap_intervals - 1.0L ? off * off : 0.0L;
  }
  found.jitter = static_cast<double>(std::sqrt(squares / static_cast<long double>(count)));
  const long double step = resolution_of(stamps);
  found.resolution_s = static_cast<double>(step * seconds);
  // The span's two ends are each known to half a step and to four times the jitter; a double's rounding is below 1e-12.
  const double tolerance = static_cast<double>(step / span) + 4.0 * found.jitter / static_cast<double>(count) + 1e-12;
  found.rate_hz = shortest_near(static_cast<double>(1.0L / (mean * seconds)), tolerance);
  return found;
}

Expected<TimeAxis> time_axis(const ColumnData& data, const ImportMap& map, const std::string& file) {
  TimeAxis axis;
  const TimeMap& time = map.time;
  axis.end_s.resize(data.rows);
  if (!time.column) {
    axis.rate_hz = map.sample_rate_hz.value_or(0.0);
    for (std::size_t k = 0; k < data.rows; ++k) {
      axis.end_s[k] = static_cast<double>(k + 1) / axis.rate_hz;
    }
    axis.notes.push_back(fmt::format("no time in the file: rows follow each other at {} Hz", axis.rate_hz));
    return axis;
  }
  const std::vector<long double>& stamps = data.stamps;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    if (!(stamps[k] > stamps[k - 1])) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {}: time {} is not after {} in the one before; increasing times are expected", file,
                              data.place(k), static_cast<double>(stamps[k]), static_cast<double>(stamps[k - 1])));
    }
  }
  const auto unit = find_unit(time.unit);
  const long double seconds = time.unit == "date" || !unit ? 1.0L : static_cast<long double>(unit->si);
  const RateOfStamps rate = rate_of(stamps, seconds);
  axis.rate_hz = map.sample_rate_hz.value_or(rate.rate_hz);
  if (!map.sample_rate_hz) {
    axis.notes.push_back(fmt::format("sample rate {} Hz, from the times", axis.rate_hz));
  }
  if (rate.jitter > 0.1) {
    axis.notes.push_back(fmt::format("the intervals between times vary by {:.0f} % rms; {}", 100.0 * rate.jitter,
                                     time.resample ? "resampled" : "not resampled (time.resample = true does)"));
  }
  // A begin or middle of an interval ends later.
  const double later = time.stamp == "begin" ? 1.0 : time.stamp == "middle" ? 0.5 : 0.0;
  const long double shift = static_cast<long double>(later / axis.rate_hz);
  const long double origin = time.origin_first
                                 ? stamps.front() * seconds + shift - 1.0L / static_cast<long double>(axis.rate_hz)
                                 : static_cast<long double>(time.origin.value_or(0.0));
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    axis.end_s[k] = static_cast<double>(stamps[k] * seconds - origin + shift);
  }
  return axis;
}

}  // namespace selfcal::import
