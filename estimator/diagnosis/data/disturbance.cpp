#include "estimator/diagnosis/data/disturbance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double margin_s = 2.0;        // of a dwell, where a turn rings on
constexpr double most_disturbed = 0.1;  // beyond it the medians are no longer those of a quiet base
constexpr std::size_t parts = 4;        // of a second

// Squares of a second's departures, all axes of a triad: from sample to sample, and of its quarters.
struct Loudness {
  double fast = 0.0, slow = 0.0;
};

using Increments = std::span<const std::array<double, 3>>;

// Fourth differences, as single samples are judged (spikes.cpp): white noise of variance 1 gives 1.944 each.
constexpr double fast_of_white = 1.0 + 2.0 * (16.0 + 1.0) / 36.0;
constexpr double slow_of_white = 2.0;  // difference of two sums, over the samples of one

Loudness loudness(Increments x, std::size_t first, std::size_t n) {
  Loudness l;
  const std::size_t part = n / parts;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = first + 2; i + 2 < first + n; ++i) {
      const double around = (4.0 * (x[i - 1][axis] + x[i + 1][axis]) - x[i - 2][axis] - x[i + 2][axis]) / 6.0;
      l.fast += (x[i][axis] - around) * (x[i][axis] - around);
    }
    std::array<double, parts> sum{};
    for (std::size_t i = 0; i < parts * part; ++i) {
      sum[i / part] += x[first + i][axis];
    }
    for (std::size_t k = 1; k < parts; ++k) {
      l.slow += (sum[k] - sum[k - 1]) * (sum[k] - sum[k - 1]);
    }
  }
  l.fast /= 3.0 * static_cast<double>(n - 4) * fast_of_white;
  l.slow /= 3.0 * static_cast<double>((parts - 1) * part) * slow_of_white;
  return l;
}

// Smallest step of the increments, 0 where they are continuous: its rounding comes and goes with the rate.
double step_of(Increments x) {
  double least = HUGE_VAL;
  for (std::size_t i = 1; i < std::min<std::size_t>(x.size(), 4000); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = std::abs(x[i][axis] - x[i - 1][axis]);
      least = step > 0.0 ? std::min(least, step) : least;
    }
  }
  return std::isfinite(least) ? least : 0.0;
}

// Marks the seconds of one triad that are far louder than the median. A quiet second's `fast` has some 60 degrees of freedom and
// more, `slow` 9: neither comes to these factors once in 10^9. On a base that sways the quarters are no noise.
void mark(Increments x, const std::vector<std::size_t>& starts, std::size_t n, std::vector<bool>& loud) {
  constexpr double fast_factor = 6.0, slow_factor = 12.0, sways = 5.0;
  std::vector<double> fast, slow;
  for (const std::size_t first : starts) {
    const Loudness l = loudness(x, first, n);
    fast.push_back(l.fast);
    slow.push_back(l.slow);
  }
  const double rounding = step_of(x) * step_of(x);
  const double usual_fast = median(fast) + rounding, usual_slow = median(slow) + rounding;
  const bool still = median(slow) < sways * usual_fast;
  for (std::size_t k = 0; k < starts.size(); ++k) {
    loud[k] = loud[k] || fast[k] > fast_factor * usual_fast || (still && slow[k] > slow_factor * usual_slow);
  }
}

}  // namespace

std::vector<FaultyStretch> find_disturbed(const ImuData& data, const std::vector<Segment>& segments) {
  const auto n = static_cast<std::size_t>(std::max(20.0, std::round(data.sample_rate_hz)));
  const auto margin = static_cast<std::size_t>(margin_s * data.sample_rate_hz);
  std::vector<std::size_t> starts;
  for (const Segment& s : segments) {
    for (std::size_t i = s.first + margin; !s.rotation && i + n + margin <= s.last; i += n) {
      starts.push_back(i);
    }
  }
  constexpr std::size_t enough = 60;
  const bool turns = std::any_of(segments.begin(), segments.end(), [](const Segment& s) { return s.rotation; });
  if (!turns || starts.size() < enough) {
    return {};
  }
  std::vector<bool> loud(starts.size(), false);
  mark(data.delta_v, starts, n, loud);
  mark(data.delta_theta, starts, n, loud);
  if (static_cast<double>(std::count(loud.begin(), loud.end(), true)) >
      most_disturbed * static_cast<double>(loud.size())) {
    return {};
  }
  std::vector<FaultyStretch> stretches;
  for (std::size_t k = 0; k < starts.size(); ++k) {
    if (loud[k] && !stretches.empty() && stretches.back().last == starts[k]) {
      stretches.back().last += n;
    } else if (loud[k]) {
      stretches.push_back({starts[k], starts[k] + n, false});
    }
  }
  return stretches;
}

}  // namespace selfcal::diagnosis
