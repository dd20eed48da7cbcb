#include "estimator/diagnosis/data/spikes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "estimator/diagnosis/data/usual_step.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::size_t axes = 6;

double value_at(const ImuData& data, std::size_t i, std::size_t axis) {
  return axis < 3 ? data.delta_theta[i][axis] : data.delta_v[i][axis - 3];
}

std::string name_of(std::size_t axis) { return std::string(axis < 3 ? "gyro " : "accelerometer ") + "xyz"[axis % 3]; }

// Samples at the extreme value in runs that are entered from a slope. A drive comes up to its rate smoothly, and where
// the noise is below the quantum the rate is one count all along: no clipping. Over the last 0.05 s before a rate is
// reached with continuous acceleration, ramps of a second and more change it by less than 0.7 %; a clipped ramp by 3 %.
// A count or two up and down are no slope: of an axis that turns by a hundred counts they are that many per cent.
struct Clipping {
  std::size_t met = 0, first = 0;
  std::vector<FaultyStretch> runs;
};

template <typename Value>
Clipping clipping(const ImuData& data, const Value& value, std::size_t first, std::size_t last, bool gyro) {
  constexpr double steep = 0.01, more_than_noise = 4.0;
  Clipping found;
  double largest = 0.0, count = std::numeric_limits<double>::infinity();
  for (std::size_t i = first; i < last; ++i) {
    if (std::abs(value(i)) > largest) {
      largest = std::abs(value(i));
      found.first = i;
    }
    const double step = i > first ? std::abs(value(i) - value(i - 1)) : 0.0;
    count = step > 0.0 ? std::min(count, step) : count;
  }
  const double rest = gyro ? 0.5 * units::degree : 11.0;  // below it the largest count of a gyro is only noise
  if (largest * data.sample_rate_hz <= rest) {
    return found;
  }
  const auto back = static_cast<std::size_t>(std::max(1.0, std::round(0.05 * data.sample_rate_hz)));
  bool run = false, counts = false;
  for (std::size_t i = first; i < last; ++i) {
    const bool extreme = std::abs(value(i)) == largest;
    if (extreme && !run) {
      counts =
          i > back && std::abs(value(i - 1) - value(i - 1 - back)) > std::max(steep * largest, more_than_noise * count);
      if (counts) {
        found.runs.push_back({i, i, gyro});
      }
    }
    run = extreme;
    if (extreme && counts) {
      ++found.met;
      found.runs.back().last = i + 1;
    }
  }
  return found;
}

// Median over the dwells: a turn changes by more.
double step_in_dwells(const ImuData& data, const std::vector<Segment>& segments, std::size_t axis) {
  std::vector<double> steps;
  for (const Segment& s : segments) {
    if (!s.rotation && s.last > s.first) {
      steps.push_back(usual_step(s.first + 1, s.last, [&](std::size_t i) { return value_at(data, i, axis); }));
    }
  }
  const double step = steps.empty() ? 0.0 : median(std::move(steps));
  return std::isfinite(step) ? step : 0.0;
}

// How far each sample in the dwells stands from what its neighbours make of it (fourth differences: a turn's smooth
// beginning has none to speak of), in sigma, signed; the samples in time's order.
struct Departures {
  std::vector<std::size_t> sample;
  std::array<std::vector<double>, axes> sigmas;
};

Departures departures(const ImuData& data, const std::vector<Segment>& segments, bool turns) {
  // A dwell's edge may hold part of a turn, and by the gyros alone all of its beginning.
  const bool gimbal = !data.gimbal_outer.empty() && !data.gimbal_inner.empty();
  const auto margin = static_cast<std::size_t>((turns ? 0.0 : gimbal ? 0.5 : 3.0) * data.sample_rate_hz);
  Departures d;
  for (const Segment& s : segments) {
    for (std::size_t i = s.first + 2 + margin; s.rotation == turns && i + 2 + margin < s.last; ++i) {
      d.sample.push_back(i);
    }
  }
  constexpr std::size_t enough = 1000;
  for (std::size_t axis = 0; axis < axes && d.sample.size() >= enough; ++axis) {
    std::vector<double>& off = d.sigmas[axis];
    for (const std::size_t i : d.sample) {
      const auto value = [&](std::size_t k) { return value_at(data, k, axis); };
      const double around = (4.0 * (value(i - 1) + value(i + 1)) - value(i - 2) - value(i + 2)) / 6.0;
      off.push_back(value(i) - around);
    }
    std::vector<double> sorted(off.size());
    std::transform(off.begin(), off.end(), sorted.begin(), [](double o) { return std::abs(o); });
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 9 / 10);
    std::nth_element(sorted.begin(), at, sorted.end());
    // The 90 % point of normal noise. Where that is below the quantum single counts stand beyond any multiple of it.
    const double sigma = std::max(*at / 1.645, 0.25 * step_in_dwells(data, segments, axis));
    for (double& o : off) {
      o = sigma > 0.0 ? o / sigma : 0.0;
    }
  }
  return d;
}

// The largest within 0.25 s, but for the sample and the two on either side, which stand out with it by up to two thirds.
double largest_nearby(const Departures& d, std::size_t axis, std::size_t k, std::size_t reach) {
  const std::vector<double>& off = d.sigmas[axis];
  double largest = 0.0;
  for (std::size_t j = k - std::min(k, reach); j < std::min(off.size(), k + reach + 1); ++j) {
    const bool own = j + 2 >= k && j <= k + 2;
    const bool same_dwell = d.sample[std::max(j, k)] - d.sample[std::min(j, k)] == std::max(j, k) - std::min(j, k);
    largest = !own && same_dwell ? std::max(largest, std::abs(off[j])) : largest;
  }
  return largest;
}

bool is_motion(const Departures& d, std::size_t axis, std::size_t k, double rate_hz) {
  constexpr double rings_s = 0.25, rings = 0.25, seen = 4.0;
  const auto reach = static_cast<std::size_t>(std::max(5.0, std::round(rings_s * rate_hz)));
  if (largest_nearby(d, axis, k, reach) > std::max(seen, rings * std::abs(d.sigmas[axis][k]))) {
    return true;
  }
  const std::size_t other = axis < 3 ? 3 : 0;
  double both = 0.0;
  for (std::size_t a = other; a < other + 3; ++a) {
    for (std::size_t j = k - std::min<std::size_t>(k, 2); j < std::min(d.sample.size(), k + 3); ++j) {
      both = std::max(both, std::abs(d.sigmas[a][j]));
    }
  }
  return both > 2.0 * seen;
}

}  // namespace

namespace {

// One sample by itself leaves two thirds of it with the other sign in both neighbours. Where a turn begins to speed up, or is clipped, a half
// is left: in turns the two are told apart.
bool stands_out(const std::vector<double>& off, std::size_t k, bool turns) {
  constexpr double in_turns = 30.0, in_dwells = 12.0, noise = 3.0, share = 0.1;
  const double size = std::abs(off[k]);
  if (size <= (turns ? in_turns : in_dwells)) {
    return false;
  }
  if (turns) {
    const double left = std::max(std::abs(off[k - 1] + off[k] / 1.5), std::abs(off[k + 1] + off[k] / 1.5));
    return left <= std::max(noise, share * size);
  }
  return size >= std::max({std::abs(off[k - 2]), std::abs(off[k - 1]), std::abs(off[k + 1]), std::abs(off[k + 2])});
}

// In dwells, or in turns.
void spikes_in(const ImuData& data, const std::vector<Segment>& segments, bool turns, std::vector<DataFault>& faults) {
  const Departures d = departures(data, segments, turns);
  for (std::size_t axis = 0; axis < axes; ++axis) {
    const std::vector<double>& off = d.sigmas[axis];
    DataFault spike{"spike", {}, 0, 0};
    for (std::size_t k = 2; k + 2 < off.size(); ++k) {
      if (stands_out(off, k, turns) && !is_motion(d, axis, k, data.sample_rate_hz)) {
        spike.first_sample = spike.count++ == 0 ? d.sample[k] : spike.first_sample;
        spike.stretches.push_back({d.sample[k] - 2, d.sample[k] + 3, axis < 3});
      }
    }
    if (spike.count > 0) {
      spike.words = name_of(axis) + ": " + std::to_string(spike.count) + " samples in " +
                    (turns ? "turns stand more than 30" : "dwells stand more than 12") +
                    " sigma from their neighbours, and no motion shows around them";
      faults.push_back(spike);
    }
  }
}

}  // namespace

void find_spikes(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  spikes_in(data, segments, false, faults);
  // What turns an IMU by hand or on wheels is not smooth; what a turn was that a spike spoils only the read-outs say.
  if (!data.gimbal_outer.empty() && !data.gimbal_inner.empty()) {
    spikes_in(data, segments, true, faults);
  }
}

void find_saturation(const ImuData& data, const std::vector<Segment>& segments, std::vector<DataFault>& faults) {
  constexpr std::size_t often = 100, in_a_turn = 20;
  constexpr double in_a_turn_s = 0.25;
  const auto least = std::max(in_a_turn, static_cast<std::size_t>(in_a_turn_s * data.sample_rate_hz));
  for (std::size_t axis = 0; axis < axes; ++axis) {
    const auto value = [&](std::size_t i) { return value_at(data, i, axis); };
    Clipping found = clipping(data, value, 0, data.size(), axis < 3);
    if (found.met <= often) {
      found = {};
      for (const Segment& s : segments) {
        const Clipping turn = s.rotation && axis < 3 ? clipping(data, value, s.first, s.last, true) : Clipping{};
        if (turn.met > least) {
          found.first = found.met == 0 ? turn.first : found.first;
          found.met += turn.met;
          found.runs.insert(found.runs.end(), turn.runs.begin(), turn.runs.end());
        }
      }
    }
    if (found.met > 0) {
      faults.push_back({"saturation",
                        name_of(axis) + " meets its extreme value " + std::to_string(found.met) + " times", found.first,
                        found.met, found.runs});
    }
  }
}

}  // namespace selfcal::diagnosis
