#include "estimator/diagnosis/data/faults.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <utility>

#include "estimator/diagnosis/data/axes.hpp"
#include "estimator/diagnosis/data/side_channels.hpp"
#include "estimator/diagnosis/data/spikes.hpp"
#include "estimator/diagnosis/data/usual_step.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

using Triple = std::array<double, 3>;

std::string number(const char* format, double a, double b = 0.0, double c = 0.0) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

void note(DataFault& fault, std::size_t sample) {
  if (fault.count++ == 0) {
    fault.first_sample = sample;
  }
}

// Adds sample i to the last stretch or begins another.
void spoil(std::vector<FaultyStretch>& stretches, std::size_t i, bool gyros) {
  if (stretches.empty() || stretches.back().last != i || stretches.back().gyros != gyros) {
    stretches.push_back({i, i, gyros});
  }
  stretches.back().last = i + 1;
}

bool same(const ImuData& d, std::size_t i, std::size_t j) {
  return d.delta_theta[i] == d.delta_theta[j] && d.delta_v[i] == d.delta_v[j];
}

double channel(const ImuData& d, std::size_t i, std::size_t axis) {
  return axis < 3 ? d.delta_theta[i][axis] : d.delta_v[i][axis - 3];
}

// How many samples equal the one before where the quantum is coarse: of each sensor the share within a second that do,
// their product over the six, for what repeats by chance repeats in one sensor at a time.
double repeats_by_chance(const ImuData& data) {
  const auto n = static_cast<std::size_t>(std::max(10.0, std::round(data.sample_rate_hz)));
  double expected = 0.0;
  for (std::size_t first = 1; first + n <= data.size(); first += n) {
    double all = 1.0;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      std::size_t equal = 0;
      for (std::size_t i = first; i < first + n; ++i) {
        equal += channel(data, i, axis) == channel(data, i - 1, axis) ? 1 : 0;
      }
      all *= static_cast<double>(equal) / static_cast<double>(n);
    }
    expected += all * static_cast<double>(n);
  }
  return expected;
}

// Zero increments never come by chance: gravity is always there. Repeated ones do, where the quantum is coarse: their
// number is held against what the quantum and the correlation from sample to sample make likely, and so is the length of a
// run.
// What a recording shows of samples that were lost.
struct Losses {
  DataFault zeros{"lost_samples", {}, 0, 0}, repeats{"lost_samples", {}, 0, 0}, gaps{"lost_samples", {}, 0, 0};
  std::size_t by_chance = 0;                   // samples like the last but one
  std::size_t longest = 0, longest_first = 0;  // samples in a row that repeat the one before
  double missing = 0.0;
  std::vector<FaultyStretch> runs;  // of three repeats and more
};

Losses count_losses(const ImuData& data) {
  constexpr Triple zero{};
  Losses l;
  std::size_t run = 0;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (data.delta_v[i] == zero) {
      note(l.zeros, i);
      spoil(l.zeros.stretches, i, data.delta_theta[i] == zero);
    } else if (i > 0 && same(data, i, i - 1)) {
      note(l.repeats, i);
    } else if (i > 1 && same(data, i, i - 2)) {
      ++l.by_chance;
    }
    run = i > 0 && same(data, i, i - 1) ? run + 1 : 0;
    if (run > l.longest) {
      l.longest = run;
      l.longest_first = i + 1 - run;
    }
    if (constexpr std::size_t least = 3; run == least) {
      l.runs.push_back({i + 1 - run, i + 1, true});
    } else if (run > least) {
      l.runs.back().last = i + 1;
    }
    const double steps = i > 0 ? (data.time_s[i] - data.time_s[i - 1]) * data.sample_rate_hz : 1.0;
    if (steps > 1.5) {
      note(l.gaps, i);
      spoil(l.gaps.stretches, i, true);
      l.missing += steps - 1.0;
    }
  }
  return l;
}

// Of n samples a run of r comes by chance n p^r times; where p is too small to be counted, 2 %. Shortest that does not; 0: none.
std::size_t improbable_run(double n, double chance) {
  constexpr double least_p = 0.02, never = 1e-4, most_p = 0.5;
  const double p = std::max(least_p, (chance + 3.0) / n);
  return p < most_p ? static_cast<std::size_t>(std::ceil(std::log(never / n) / std::log(p))) : 0;
}

// Difference of two counts, 5 sigma; sensors move together, and neighbours are alike by half more often than their product.
bool more_than_chance(double repeats, double chance) {
  constexpr double moving_excess = 40.0, together = 0.5;
  return repeats - chance > std::max({moving_excess, 5.0 * std::sqrt(2.0 * chance + 1.0), together * chance});
}

void repeated_samples(const ImuData& data, Losses& l, std::vector<DataFault>& faults) {
  const double chance = std::max(static_cast<double>(l.by_chance), repeats_by_chance(data));
  const std::size_t improbable = improbable_run(static_cast<double>(data.size()), chance);
  std::vector<FaultyStretch> runs;
  std::size_t in_runs = 0;
  for (const FaultyStretch& run : l.runs) {
    if (improbable > 0 && run.last - run.first >= improbable) {
      runs.push_back(run);
      in_runs += run.last - run.first;
    }
  }
  if (more_than_chance(static_cast<double>(l.repeats.count), chance)) {
    l.repeats.words = number("%.0f samples repeat the one before (%.0f expected by chance)",
                             static_cast<double>(l.repeats.count), chance);
    if (!more_than_chance(static_cast<double>(l.repeats.count - in_runs), chance)) {
      l.repeats.stretches = runs;
    }
    faults.push_back(l.repeats);
  } else if (l.zeros.count == 0 && !runs.empty()) {
    faults.push_back({"lost_samples",
                      number("%.0f samples in a row repeat the one before", static_cast<double>(l.longest)),
                      l.longest_first, l.longest, runs});
  }
}

void lost_samples(const ImuData& data, std::vector<DataFault>& faults) {
  Losses l = count_losses(data);
  if (l.zeros.count > 0) {
    l.zeros.words = number("%.0f samples have zero velocity increments", static_cast<double>(l.zeros.count));
    faults.push_back(l.zeros);
  }
  repeated_samples(data, l, faults);
  if (l.gaps.count > 0) {
    l.gaps.words = number("%.0f gaps, %.0f samples missing", static_cast<double>(l.gaps.count), l.missing);
    faults.push_back(l.gaps);
  }
}

void time_base(const ImuData& data, std::vector<DataFault>& faults) {
  std::vector<double> dt;
  for (std::size_t i = 1; i < data.size(); ++i) {
    dt.push_back(data.time_s[i] - data.time_s[i - 1]);
  }
  const double rate = 1.0 / median(std::move(dt));
  if (std::abs(rate / data.sample_rate_hz - 1.0) > 1e-3) {
    faults.push_back({"time_base",
                      number("time stamps run at %.6g Hz, the rate is stated as %.6g Hz", rate, data.sample_rate_hz), 0,
                      data.size()});
  }
}

// One axis: its samples, their sums up to each, and its usual step.
struct AxisSamples {
  bool gyro = false;
  std::vector<double> value;
  std::vector<double> sum;  // of the samples before
  double count = 0.0;
};

AxisSamples axis_samples(const ImuData& data, std::size_t axis) {
  AxisSamples a{.gyro = axis < 3, .value = {}, .sum = {0.0}};
  for (std::size_t i = 0; i < data.size(); ++i) {
    a.value.push_back(a.gyro ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3]);
    a.sum.push_back(a.sum.back() + a.value.back());
  }
  a.count = usual_step(1, data.size(), [&](std::size_t i) { return a.value[i]; });
  return a;
}

// Samples [first, last) cut where the value changes.
std::vector<std::pair<std::size_t, std::size_t>> runs_of_one_value(const AxisSamples& a, std::size_t first,
                                                                   std::size_t last) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  for (std::size_t start = first, i = first + 1; start < last; ++i) {
    if (i >= last || a.value[i] != a.value[start]) {
      runs.emplace_back(start, i);
      start = i;
    }
  }
  return runs;
}

// How long a gyro gives zero in a dwell and counts again in the same, the third longest time: the longest may be those in which it is stuck.
double usual_rest_s(const ImuData& data, const std::vector<Segment>& segments, const AxisSamples& a) {
  constexpr std::size_t third = 2;
  std::vector<std::size_t> rests;
  for (const Segment& s : segments) {
    if (s.rotation) {
      continue;
    }
    const auto runs = runs_of_one_value(a, s.first, s.last);
    for (std::size_t k = 1; k + 1 < runs.size(); ++k) {
      if (std::abs(a.value[runs[k].first]) < 0.5 * a.count) {
        rests.push_back(runs[k].second - runs[k].first);
      }
    }
  }
  if (rests.size() <= third) {
    return 0.0;
  }
  std::nth_element(rests.begin(), rests.begin() + third, rests.end(), std::greater<>());
  return static_cast<double>(rests[third]) / data.sample_rate_hz;
}

// A dwell's edge may hold part of a turn.
std::vector<Segment> without_edges(std::vector<Segment> segments, double rate_hz) {
  const auto margin = static_cast<std::size_t>(rate_hz);
  for (Segment& s : segments) {
    if (!s.rotation && s.last - s.first > 2 * margin) {
      s.first += margin;
      s.last -= margin;
    }
  }
  return segments;
}

// What the other samples of a segment in which a run of one value lies would have made of its length, less what it made; of several segments
// the least. Infinite where they are too few to tell.
double departure(const AxisSamples& a, const std::vector<Segment>& segments, std::size_t start, std::size_t end) {
  constexpr double most_of_segment = 0.7;
  const double length = static_cast<double>(end - start), made = a.sum[end] - a.sum[start];
  const auto sum = [&](std::size_t first, std::size_t last) { return first < last ? a.sum[last] - a.sum[first] : 0.0; };
  double least = std::numeric_limits<double>::infinity();
  for (const Segment& s : segments) {
    if (s.first < end && s.last > start) {
      const double whole = static_cast<double>(s.last - s.first);
      const double others = whole - static_cast<double>(std::min(end, s.last) - std::max(start, s.first));
      if (others > (1.0 - most_of_segment) * whole) {
        least = std::min(least, std::abs((sum(s.first, start) + sum(end, s.last)) / others * length - made));
      }
    }
  }
  return least;
}

// An axis that gives one value for long. Of a coarse quantum it rests at a count for seconds where it hardly moves (gyros), or where what it
// measures is nearly a whole count a sample; the rest of the dwell tells the same then. If the rest of the dwell moves it by more than a few
// counts in that time, it was stuck. Where a gyro hardly turns in all of a dwell, as an upright one at the equator, it may rest for a few
// times what it has rested elsewhere.
// Adds the stretches of a segment in which an axis gives one value for longer than it can. `rest_s`: of usual_rest_s().
void find_stuck(const AxisSamples& a, double rate_hz, const std::vector<Segment>& segments, const Segment& s,
                double rest_s, DataFault& fault) {
  constexpr double least_gyro_s = 30.0, least_s = 1.0, accel_s = 2.0, counts = 8.0, few = 4.0;
  const auto margin = static_cast<std::size_t>(rate_hz);  // a dwell's edge may hold part of a turn
  const std::size_t first = s.first + margin, last = std::max(first, s.last - std::min(s.last, margin));
  for (const auto& [start, end] : runs_of_one_value(a, first, last)) {
    const double length_s = static_cast<double>(end - start) / rate_hz;
    if (length_s <= least_s) {
      continue;
    }
    const double departs = departure(a, segments, start, end);
    const bool same = departs <= counts * a.count;
    const bool left_behind = a.gyro && !s.rotation && std::isfinite(departs) && !same;
    const bool zero = std::abs(a.value[start]) < 0.5 * a.count;
    const double longest_s = !a.gyro ? accel_s : zero ? std::max(least_gyro_s, few * rest_s) : least_gyro_s;
    if (left_behind || (length_s > longest_s && !same)) {
      fault.first_sample = fault.count == 0 ? start : fault.first_sample;
      fault.count += end - start;
      fault.stretches.push_back({start, end, a.gyro});
    }
  }
}

void frozen_axes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  const std::vector<Segment> whole = {{.last = data.size()}};  // of accelerometers, whether the IMU turns or stands
  const std::vector<Segment> inner = without_edges(segments, data.sample_rate_hz);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const AxisSamples a = axis_samples(data, axis);
    const double rest_s = a.gyro ? usual_rest_s(data, segments, a) : 0.0;
    DataFault fault{"frozen_axis", {}, 0, 0};
    for (const Segment& s : a.gyro ? segments : whole) {
      find_stuck(a, data.sample_rate_hz, inner, s, rest_s, fault);
    }
    if (fault.count > 0) {
      fault.words = std::string(a.gyro ? "gyro " : "accelerometer ") + "xyz"[axis % 3] +
                    number(" gives one value for %.1f s", static_cast<double>(fault.count) / data.sample_rate_hz);
      faults.push_back(fault);
    }
  }
}

}  // namespace

std::string no_readings(std::span<const std::array<double, 3>> gyro, std::span<const std::array<double, 3>> accel) {
  const auto never_changes = [](std::span<const std::array<double, 3>> series) {
    return std::all_of(series.begin(), series.end(), [&](const auto& row) { return row == series.front(); });
  };
  return never_changes(gyro) && never_changes(accel) ? "all axes stand at one value throughout: no readings of a sensor"
                                                     : "";
}

std::vector<DataFault> find_data_faults(const ImuData& data) {
  std::vector<DataFault> faults;
  ImuData sensors = data;
  const MendedSideChannels mended = mend_side_channels(data);
  if (!mended.faults.empty()) {
    sensors.gimbal_outer = mended.outer;
    sensors.gimbal_inner = mended.inner;
    faults = mended.faults;
  }
  if (read_outs_in_degrees(data)) {
    sensors.gimbal_outer = sensors.gimbal_inner = {};
  }
  const std::vector<Segment> segments = find_segments(sensors);
  lost_samples(data, faults);
  time_base(data, faults);
  frozen_axes(data, segments, faults);
  find_spikes(sensors, segments, faults);
  find_saturation(data, segments, faults);
  if (faults.empty()) {  // else what a turn adds up to is no question of axes
    find_wrong_axes(data, segments, faults);
  }
  return faults;
}

}  // namespace selfcal::diagnosis
