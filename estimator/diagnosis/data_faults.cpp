#include "estimator/diagnosis/data_faults.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/diagnosis/data_axes.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"

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

bool same(const ImuData& d, std::size_t i, std::size_t j) {
  return d.delta_theta[i] == d.delta_theta[j] && d.delta_v[i] == d.delta_v[j];
}

// Zero increments never come by chance: gravity is always there. Repeated ones do, where the quantum is coarse: their
// number is held against that of samples equal to the last but one, and so is the length of a run.
void lost_samples(const ImuData& data, std::vector<DataFault>& faults) {
  constexpr Triple zero{};
  DataFault zeros{"lost_samples", {}, 0, 0}, repeats{"lost_samples", {}, 0, 0}, gaps{"lost_samples", {}, 0, 0};
  std::size_t by_chance = 0, run = 0, longest = 0, longest_first = 0;
  double missing = 0.0;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (data.delta_v[i] == zero) {
      note(zeros, i);
    } else if (i > 0 && same(data, i, i - 1)) {
      note(repeats, i);
    } else if (i > 1 && same(data, i, i - 2)) {
      ++by_chance;
    }
    run = i > 0 && same(data, i, i - 1) ? run + 1 : 0;
    if (run > longest) {
      longest = run;
      longest_first = i + 1 - run;
    }
    const double steps = i > 0 ? (data.time_s[i] - data.time_s[i - 1]) * data.sample_rate_hz : 1.0;
    if (steps > 1.5) {
      note(gaps, i);
      missing += steps - 1.0;
    }
  }
  const auto chance = static_cast<double>(by_chance);
  const double excess = static_cast<double>(repeats.count) - chance;
  if (zeros.count > 0) {
    zeros.words = number("%.0f samples have zero velocity increments", static_cast<double>(zeros.count));
    faults.push_back(zeros);
  }
  // Difference of two counts, 5 sigma; on a moving base neighbours are alike a little more often than that.
  constexpr double moving_excess = 40.0;
  if (excess > std::max(moving_excess, 5.0 * std::sqrt(2.0 * chance + 1.0))) {
    repeats.words = number("%.0f samples repeat the one before (%.0f expected by chance)",
                           static_cast<double>(repeats.count), chance);
    faults.push_back(repeats);
  } else if (zeros.count == 0) {
    // Of n samples a run of r comes by chance n p^r times; where p is too small to be counted, 2 %.
    const auto n = static_cast<double>(data.size());
    constexpr double least_p = 0.02, never = 1e-4;
    const double p = std::max(least_p, (chance + 3.0) / n);
    if (p < 0.5 && n * std::pow(p, static_cast<double>(longest)) < never) {
      faults.push_back({"lost_samples",
                        number("%.0f samples in a row repeat the one before", static_cast<double>(longest)),
                        longest_first, longest});
    }
  }
  if (gaps.count > 0) {
    gaps.words = number("%.0f gaps, %.0f samples missing", static_cast<double>(gaps.count), missing);
    faults.push_back(gaps);
  }
}

void time_base(const ImuData& data, std::vector<DataFault>& faults) {
  std::vector<double> dt;
  for (std::size_t i = 1; i < data.size(); ++i) {
    dt.push_back(data.time_s[i] - data.time_s[i - 1]);
  }
  std::nth_element(dt.begin(), dt.begin() + static_cast<std::ptrdiff_t>(dt.size() / 2), dt.end());
  const double rate = 1.0 / dt[dt.size() / 2];
  if (std::abs(rate / data.sample_rate_hz - 1.0) > 1e-3) {
    faults.push_back({"time_base",
                      number("time stamps run at %.6g Hz, the rate is stated as %.6g Hz", rate, data.sample_rate_hz), 0,
                      data.size()});
  }
}

// Median of the changes from sample to sample: the quantum where it is coarse.
template <typename Value>
double usual_step(std::size_t samples, const Value& value) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples; ++i) {
    if (value(i) != value(i - 1)) {
      steps.push_back(std::abs(value(i) - value(i - 1)));
    }
  }
  if (steps.empty()) {
    return HUGE_VAL;
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// An axis that gives one value for long. Gyros of coarse quantum rest at a count for seconds where they hardly turn; if the
// rest of the dwell turns them by more than a few counts in that time, they were stuck. Accelerometers never rest.
void frozen_axes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  constexpr double gyro_s = 30.0, least_s = 1.0, accel_s = 2.0, counts = 8.0, most_of_dwell = 0.7;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const bool gyro = axis < 3;
    const auto value = [&](std::size_t i) { return gyro ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3]; };
    const double count = usual_step(data.size(), value);
    const auto margin = static_cast<std::size_t>(data.sample_rate_hz);  // a dwell's edge may hold part of a turn
    DataFault fault{"frozen_axis", {}, 0, 0};
    const auto stuck = [&](std::size_t first, std::size_t last) {
      fault.first_sample = fault.count == 0 ? first : fault.first_sample;
      fault.count += last - first;
    };
    for (const Segment& s : segments) {
      const std::size_t first = s.first + margin, last = std::max(first, s.last - std::min(s.last, margin));
      double sum = 0.0;
      for (std::size_t i = first; i < last; ++i) {
        sum += value(i);
      }
      const auto n = static_cast<double>(last - first);
      std::size_t start = first;
      for (std::size_t i = first + 1; i <= last; ++i) {
        if (i < last && value(i) == value(start)) {
          continue;
        }
        const auto length = static_cast<double>(i - start);
        const double length_s = length / data.sample_rate_hz;
        const double turned = (sum - length * value(start)) / (n - length) * length - length * value(start);
        const bool left_behind = gyro && !s.rotation && length < most_of_dwell * n && length_s > least_s &&
                                 std::abs(turned) > counts * count;
        if (left_behind || length_s > (gyro ? gyro_s : accel_s)) {
          stuck(start, i);
        }
        start = i;
      }
    }
    if (fault.count > 0) {
      fault.words = std::string(gyro ? "gyro " : "accelerometer ") + "xyz"[axis % 3] +
                    number(" gives one value for %.1f s", static_cast<double>(fault.count) / data.sample_rate_hz);
      faults.push_back(fault);
    }
  }
}

// Samples at the extreme value in runs that are entered from a slope. A drive comes up to its rate smoothly, and where
// the noise is below the quantum the rate is one count all along: no clipping. Over the last 0.05 s before a rate is
// reached with continuous acceleration, ramps of a second and more change it by less than 0.7 %; a clipped ramp by 3 %.
template <typename Value>
std::size_t steeply_met(const ImuData& data, const Value& value, double largest) {
  constexpr double steep = 0.01;
  const auto back = static_cast<std::size_t>(std::max(1.0, std::round(0.05 * data.sample_rate_hz)));
  std::size_t met = 0;
  bool run = false, counts = false;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const bool extreme = std::abs(value(i)) == largest;
    if (extreme && !run) {
      counts = i > back && std::abs(value(i - 1) - value(i - 1 - back)) > steep * largest;
    }
    run = extreme;
    met += extreme && counts ? 1 : 0;
  }
  return met;
}

// Single samples far from their neighbours in dwells (fourth differences: a turn's smooth beginning has none to speak of);
// and extreme values that are met again and again.
void spikes_and_saturation(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  // A dwell's edge may hold part of a turn, and by the gyros alone all of its beginning.
  const bool gimbal = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  const auto margin = static_cast<std::size_t>((gimbal ? 0.5 : 3.0) * data.sample_rate_hz);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const auto value = [&](std::size_t i) { return axis < 3 ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3]; };
    const std::string name = std::string(axis < 3 ? "gyro " : "accelerometer ") + "xyz"[axis % 3];
    std::vector<std::pair<double, std::size_t>> off;  // in time's order
    double largest = 0.0;
    std::size_t met = 0, first_met = 0;
    for (std::size_t i = 0; i < data.size(); ++i) {
      if (std::abs(value(i)) > largest) {
        largest = std::abs(value(i));
        met = 0;
        first_met = i;
      }
      met += std::abs(value(i)) == largest ? 1 : 0;
    }
    for (const Segment& s : segments) {
      for (std::size_t i = s.first + 2 + margin; !s.rotation && i + 2 + margin < s.last; ++i) {
        const double around = (4.0 * (value(i - 1) + value(i + 1)) - value(i - 2) - value(i + 2)) / 6.0;
        off.emplace_back(std::abs(value(i) - around), i);
      }
    }
    if (off.size() < 1000) {
      continue;
    }
    std::vector<std::pair<double, std::size_t>> sorted = off;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 9 / 10);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double limit = 12.0 * middle->first / 1.645;  // the 90 % point is 1.645 sigma: 12 sigma
    DataFault spike{"spike", {}, 0, 0};
    for (std::size_t k = 2; k + 2 < off.size(); ++k) {  // its neighbours stand out too, by two thirds of it
      const bool largest_around = off[k] >= std::max({off[k - 2], off[k - 1], off[k + 1], off[k + 2]});
      if (off[k].first > limit && limit > 0.0 && largest_around) {
        note(spike, off[k].second);
      }
    }
    if (spike.count > 0) {
      spike.words = name + number(": %.0f samples in dwells stand more than 12 sigma from their neighbours",
                                  static_cast<double>(spike.count));
      faults.push_back(spike);
    }
    met = steeply_met(data, value, largest);
    constexpr std::size_t often = 100;
    constexpr double rest_rate = 0.5 * units::degree;  // below it the largest count of a gyro is only noise
    const bool loud = axis < 3 ? largest * data.sample_rate_hz > rest_rate : largest * data.sample_rate_hz > 11.0;
    if (met > often && loud) {
      faults.push_back({"saturation", name + number(" meets its extreme value %.0f times", static_cast<double>(met)),
                        first_met, met});
    }
  }
}

}  // namespace

std::vector<DataFault> find_data_faults(const ImuData& data) {
  std::vector<DataFault> faults;
  const std::vector<Segment> segments = find_segments(data);
  lost_samples(data, faults);
  time_base(data, faults);
  frozen_axes(data, segments, faults);
  spikes_and_saturation(data, segments, faults);
  if (faults.empty()) {  // else what a turn adds up to is no question of axes
    find_wrong_axes(data, segments, faults);
  }
  return faults;
}

}  // namespace selfcal::diagnosis
