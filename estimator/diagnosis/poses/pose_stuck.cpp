#include "estimator/diagnosis/poses/pose_stuck.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

using Series = std::vector<std::array<double, 3>>;

// The longest run of one value, and how many samples elsewhere repeat the one before.
struct LongestRun {
  std::size_t first = 0, last = 0, repeats_elsewhere = 0;
};

LongestRun longest_run(const Series& series, std::size_t axis) {
  LongestRun best;
  std::size_t first = 0, repeats = 0;
  for (std::size_t i = 1; i <= series.size(); ++i) {
    if (i < series.size() && series[i][axis] == series[i - 1][axis]) {
      ++repeats;
      continue;
    }
    if (i - first > best.last - best.first) {
      best = {first, i, 0};
    }
    first = i;
  }
  best.repeats_elsewhere = repeats - std::min(repeats, best.last - best.first - 1);
  return best;
}

double range_of(const Series& series, std::size_t axis, std::size_t first, std::size_t last) {
  const auto [low, high] = std::minmax_element(series.begin() + static_cast<std::ptrdiff_t>(first),
                                               series.begin() + static_cast<std::ptrdiff_t>(last),
                                               [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; });
  return (*high)[axis] - (*low)[axis];
}

// Whether the axis takes part in what the triad does: one that a table hardly turns may read one value of a coarse quantum for long.
bool takes_part(const Series& series, std::size_t axis) {
  constexpr double share = 0.05;
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    largest = std::max(largest, range_of(series, k, 0, series.size()));
  }
  return range_of(series, axis, 0, series.size()) > share * largest;
}

// Whether another axis of the triad moves in the run by at least half of what it does in the whole log.
bool others_move(const Series& series, std::size_t axis, const LongestRun& run) {
  constexpr double share = 0.5;
  for (const std::size_t other : {(axis + 1) % 3, (axis + 2) % 3}) {
    const double all = range_of(series, other, 0, series.size());
    if (all > 0.0 && range_of(series, other, run.first, run.last) > share * all) {
      return true;
    }
  }
  return false;
}

}  // namespace

std::vector<StuckAxis> find_stuck(const PoseInput& input) {
  std::vector<StuckAxis> all;
  constexpr double by_chance = -20.7;  // ln 1e-9
  constexpr double least_s = 2.0;
  for (int k = 0; k < 6; ++k) {
    const bool gyro = k < 3;
    const auto axis = static_cast<std::size_t>(k % 3);
    if (input.sensors == (gyro ? Sensors::accelerometers : Sensors::gyros) || (gyro && !input.gyro_axes[axis])) {
      continue;
    }
    const Series& series = gyro ? input.gyro : input.accel;
    const LongestRun run = longest_run(series, axis);
    const std::size_t length = run.last - run.first;
    const double elsewhere = static_cast<double>(series.size() - length) + 1.0;
    const double log_repeat = std::log((static_cast<double>(run.repeats_elsewhere) + 1.0) / (elsewhere + 1.0));
    const bool throughout = length == series.size();
    const bool unlikely = takes_part(series, axis) && static_cast<double>(length) * log_repeat < by_chance &&
                          input.time_s[run.last - 1] - input.time_s[run.first] > least_s;
    if ((throughout || unlikely) && others_move(series, axis, run)) {
      all.push_back({gyro, k % 3, run.first, run.last, throughout});
    }
  }
  return all;
}

void add_dead_axes(const std::vector<StuckAxis>& stuck, PoseDiagnosis& d) {
  for (const StuckAxis& s : stuck) {
    const std::string words =
        std::string(s.gyro ? "gyro " : "accelerometer ") + "xyz"[s.axis] + " reads one value throughout";
    if (s.throughout && s.gyro) {
      d.gyro_axes[static_cast<std::size_t>(s.axis)] = false;
      d.invisible.push_back("gyros that turn, since " + words +
                            ": it does not answer, or its quantum hides all that it senses");
    } else if (s.throughout) {
      d.failure = words + ": it does not answer, and without it gravity is no reference";
    }
  }
}

}  // namespace selfcal::diagnosis
