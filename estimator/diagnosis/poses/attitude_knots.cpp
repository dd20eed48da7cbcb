#include "estimator/diagnosis/poses/attitude_knots.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

using Quaternions = std::vector<Eigen::Quaterniond>;

// q and -q are one attitude.
bool alike(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.coeffs() == b.coeffs() || a.coeffs() == -b.coeffs();
}

std::vector<double> steps_of(const std::vector<double>& times) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < times.size(); ++k) {
    steps.push_back(times[k] - times[k - 1]);
  }
  return steps;
}

// Samples with one value, one after the other.
struct Run {
  std::size_t first = 0, last = 0;
};

std::vector<Run> runs_of(const std::vector<std::size_t>& valid, const Quaternions& q) {
  std::vector<Run> runs;
  for (const std::size_t i : valid) {
    if (!runs.empty() && alike(q[runs.back().first], q[i])) {
      runs.back().last = i;
    } else {
      runs.push_back({i, i});
    }
  }
  return runs;
}

// Whether values are held where the body turns fastest. At rest a coarse value stands still as well.
bool values_are_held(const std::vector<std::size_t>& valid, const ReferenceAttitude& attitude) {
  const Quaternions& q = attitude.readings.front().q_rm;
  constexpr std::size_t beside = 10;
  constexpr double fastest = 0.7, share = 0.15;
  std::vector<std::pair<double, bool>> turned;
  for (std::size_t k = beside; k + beside < valid.size(); ++k) {
    turned.emplace_back(q[valid[k - beside]].angularDistance(q[valid[k + beside]]),
                        alike(q[valid[k - 1]], q[valid[k]]));
  }
  std::sort(turned.begin(), turned.end());
  const auto begin = turned.begin() + static_cast<std::ptrdiff_t>(fastest * static_cast<double>(turned.size()));
  const auto held = std::count_if(begin, turned.end(), [](const auto& t) { return t.second; });
  return static_cast<double>(held) > share * static_cast<double>(turned.end() - begin);
}

// Times of one piece by the clock whose values they are: a line through them, if none is off by more than a row.
void even_piece(std::vector<double>& times, std::size_t first, std::size_t last, double interval, double row) {
  constexpr std::size_t fewest = 20, for_a_slope = 100;
  const std::size_t n = last - first;
  if (n < fewest) {
    return;
  }
  std::vector<double> index{0.0};
  double at = times[first];
  constexpr double gain = 0.05;
  for (std::size_t k = first + 1; k < last; ++k) {
    const double steps = std::max(1.0, std::round((times[k] - at) / interval));
    index.push_back(index.back() + steps);
    at += steps * interval;
    at += gain * (times[k] - at);
  }
  double mean_index = 0.0, mean_time = 0.0, square = 0.0, product = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    mean_index += index[k] / static_cast<double>(n);
    mean_time += (times[first + k] - times[first]) / static_cast<double>(n);
  }
  for (std::size_t k = 0; k < n; ++k) {
    square += (index[k] - mean_index) * (index[k] - mean_index);
    product += (index[k] - mean_index) * (times[first + k] - times[first] - mean_time);
  }
  const double slope = n < for_a_slope ? interval : product / square;
  std::vector<double> even(n);
  constexpr double most = 0.75;  // of a row: half is what its own clock makes
  for (std::size_t k = 0; k < n; ++k) {
    even[k] = times[first] + mean_time + slope * (index[k] - mean_index);
    if (std::abs(even[k] - times[first + k]) > most * row) {
      return;
    }
  }
  std::copy(even.begin(), even.end(), times.begin() + static_cast<std::ptrdiff_t>(first));
}

void make_even(std::vector<double>& times, double interval, double row) {
  constexpr double gap = 3.5;
  const auto steps = steps_of(times);
  double sum = 0.0, count = 0.0;
  for (const double step : steps) {
    sum += step < 2.5 * interval ? step : 0.0;
    count += step < 2.5 * interval ? 1.0 : 0.0;
  }
  const double mean = sum / std::max(1.0, count);
  std::size_t first = 0;
  for (std::size_t k = 1; k <= times.size(); ++k) {
    if (k == times.size() || steps[k - 1] > gap * mean) {
      even_piece(times, first, k, mean, row);
      first = k;
    }
  }
}

void mark_gaps(Knots& knots) {
  constexpr double gap = 5.0;
  for (std::size_t k = 0; k < knots.all.size(); ++k) {
    Knot& knot = knots.all[k];
    knot.begins = k == 0 || (!knot.held && knot.time_s - knots.all[k - 1].time_s > gap * knots.interval_s);
  }
}

// How far the turn to the next value is from that to this one.
std::vector<double> bends_of(const std::vector<Knot>& all, const Quaternions& q) {
  std::vector<double> bends(all.size(), 0.0);
  for (std::size_t k = 1; k + 1 < all.size(); ++k) {
    const Eigen::Quaterniond before = q[all[k - 1].sample].conjugate() * q[all[k].sample];
    const Eigen::Quaterniond next = q[all[k].sample].conjugate() * q[all[k + 1].sample];
    bends[k] = before.angularDistance(next);
  }
  return bends;
}

// A marker that is taken for another one makes one value jump, and the next one back.
void leave_out_spikes(Knots& knots, const Quaternions& q) {
  constexpr std::size_t near = 2, reach = 6;
  constexpr double apart = 8.0, least = 1e-6, gap = 3.0;  // least: rad
  const std::vector<double> bends = bends_of(knots.all, q);
  std::vector<Knot> kept;
  for (std::size_t k = 0; k < knots.all.size(); ++k) {
    double usual = least;
    for (std::size_t j = near; j <= reach && k >= reach && k + reach < knots.all.size(); ++j) {
      usual = std::max({usual, bends[k - j], bends[k + j]});
    }
    const bool inside = k >= reach && k + reach < knots.all.size() && !knots.all[k].held && !knots.all[k + 1].held &&
                        knots.all[k + 1].time_s - knots.all[k - 1].time_s < gap * knots.interval_s;
    const bool spike = inside && bends[k] > apart * usual && bends[k] > bends[k - 1] && bends[k] > bends[k + 1];
    if (spike) {
      ++knots.left_out;
    } else {
      kept.push_back(knots.all[k]);
    }
  }
  knots.all = std::move(kept);
}

// More stamps than that tell nothing new at the price of time.
void thin(Knots& knots) {
  constexpr std::size_t most = 60000;
  const std::size_t stride = knots.all.size() / most + 1;
  if (stride == 1) {
    return;
  }
  std::vector<Knot> kept;
  for (std::size_t k = 0; k < knots.all.size(); ++k) {
    if (k % stride == 0 || knots.all[k].held) {
      kept.push_back(knots.all[k]);
    }
  }
  knots.all = std::move(kept);
  knots.interval_s *= static_cast<double>(stride);
}

}  // namespace

Knots find_knots(const ReferenceAttitude& attitude) {
  const Quaternions& q = attitude.readings.front().q_rm;
  Knots knots;
  std::vector<std::size_t> valid;
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (q[i].coeffs().allFinite()) {
      valid.push_back(i);
    }
  }
  knots.without = q.size() - valid.size();
  constexpr std::size_t fewest = 30;
  if (valid.size() < fewest) {
    return knots;
  }
  const bool held = attitude.in_rows_of_log && values_are_held(valid, attitude);
  const std::vector<Run> runs = runs_of(valid, q);
  const double row = median(steps_of(attitude.time_s));
  std::vector<double> begin;
  begin.reserve(runs.size());
  for (const Run& run : runs) {
    begin.push_back(attitude.time_s[run.first]);
  }
  if (runs.size() < fewest) {
    return knots;
  }
  knots.interval_s = held ? median(steps_of(begin)) : row;
  if (held) {
    make_even(begin, knots.interval_s, row);
    knots.interval_s = median(steps_of(begin));
  }
  constexpr double longer = 3.5;
  const double most = held ? longer * knots.interval_s : std::max(0.1, 5.0 * row);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& run = runs[k];
    const double end = held && k + 1 < runs.size() ? begin[k + 1] - knots.interval_s : attitude.time_s[run.last];
    knots.all.push_back({begin[k], run.first});
    if (end - begin[k] > most) {
      // What lies between the last row of the run and the next value is no rest but a gap.
      knots.all.push_back({std::min(end, attitude.time_s[run.last]), run.last, false, true});
    } else if (!held) {
      for (std::size_t i = run.first + 1; i <= run.last; ++i) {
        if (q[i].coeffs().allFinite()) {
          knots.all.push_back({attitude.time_s[i], i});
        }
      }
    }
  }
  leave_out_spikes(knots, q);
  thin(knots);
  mark_gaps(knots);
  return knots;
}

}  // namespace selfcal::diagnosis
