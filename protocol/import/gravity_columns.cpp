#include "protocol/import/gravity_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

namespace selfcal::import {
namespace {

// Sine of a turn of the direction, which three columns with a large constant one among them do not make.
constexpr double turns = 0.5;

// In which unit a size is gravity's; no words: in none.
struct GravityUnit {
  std::string words;
  bool metres = false;  // of m/s^2 or m/s
};

struct Candidate {
  Triad triad{};
  SizeOfTriad size;
  GravityUnit unit;
};

GravityUnit gravity_unit(double size, const std::vector<double>& intervals_s) {
  constexpr double gravity = 9.807, near = 0.03;
  const auto is = [size](double one) { return std::abs(size / one - 1.0) < near; };
  for (const auto& [one, unit] : {std::pair{gravity, "m/s^2"}, std::pair{1.0, "g"}, std::pair{1000.0, "mg"}}) {
    if (is(one)) {
      return {fmt::format("{:.4g}, gravity's in {}", size, unit), one == gravity};
    }
  }
  for (const double interval : intervals_s) {
    for (const auto& [one, unit] : {std::pair{gravity, "m/s"}, std::pair{1.0, "g*s"}}) {
      if (is(one * interval)) {
        return {fmt::format("{:.4g}, gravity's in increments of {}", size, unit), one == gravity};
      }
    }
  }
  return {};
}

// Whether three free columns side by side stand beside TRIAD.
bool leaves_gyros(const Triad& triad, const std::vector<Triad>& free) {
  return std::any_of(free.begin(), free.end(), [&triad](const Triad& other) {
    return other.back() < triad.front() || other.front() > triad.back();
  });
}

// The least noise of three columns over the largest: of one sensor nearly 1.
double likeness(const Values& values, const Triad& triad) {
  double least = HUGE_VAL, most = 0.0;
  for (const std::size_t k : triad) {
    const double noise = row_noise(values[k]);
    least = std::min(least, noise);
    most = std::max(most, noise);
  }
  return most > 0.0 ? least / most : 0.0;
}

// Whether the size of three columns has next to none of the noise that they have: somebody has divided them by it.
bool is_direction(const Values& values, const Triad& triad) {
  constexpr double none = 0.03;
  std::vector<double> size(values[triad[0]].size());
  double most = 0.0;
  for (std::size_t row = 0; row < size.size(); ++row) {
    size[row] = std::hypot(values[triad[0]][row], values[triad[1]][row], values[triad[2]][row]);
  }
  for (const std::size_t k : triad) {
    most = std::max(most, row_noise(values[k]));
  }
  return row_noise(size) < none * most;
}

bool overlap(const Triad& a, const Triad& b) { return a.front() <= b.back() && b.front() <= a.back(); }

}  // namespace

double row_noise(const std::vector<double>& values) {
  double square = 0.0;
  for (std::size_t k = 2; k < values.size(); ++k) {
    square += std::pow(values[k] - 2.0 * values[k - 1] + values[k - 2], 2);
  }
  return values.size() < 3 ? 0.0 : std::sqrt(square / (6.0 * static_cast<double>(values.size() - 2)));
}

bool is_constant(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [&values](double v) { return v == values.front(); });
}

Triad nearest_zero(const Values& values, const std::vector<Triad>& free) {
  const auto off_zero = [&values](const Triad& triad) {
    double most = 0.0;
    for (const std::size_t k : triad) {
      const double noise = row_noise(values[k]);
      const double mean =
          std::accumulate(values[k].begin(), values[k].end(), 0.0) / static_cast<double>(values[k].size());
      most = std::max(most, noise > 0.0 ? std::abs(mean) / noise : HUGE_VAL);
    }
    return most;
  };
  return *std::min_element(free.begin(), free.end(),
                           [&](const Triad& a, const Triad& b) { return off_zero(a) < off_zero(b); });
}

std::optional<SizeOfTriad> size_of_triad(const Values& values, const Triad& triad, std::size_t samples) {
  const TriadColumns columns = triad_columns(values, triad);
  const Motion motion = find_motion(columns, columns, std::nullopt, samples);
  constexpr std::size_t fewest = 8;
  if (motion.blocks.size() < fewest) {
    return std::nullopt;
  }
  const auto count = static_cast<double>(motion.blocks.size());
  double sum = 0.0;
  for (const Block& block : motion.blocks) {
    sum += block.accel.norm() / count;
  }
  SizeOfTriad found;
  double squares = 0.0;
  const Vector3 first = motion.blocks.front().accel.normalized();
  for (const Block& block : motion.blocks) {
    squares += std::pow(block.accel.norm() / sum - 1.0, 2) / count;
    found.turned = std::max(found.turned, block.accel.normalized().cross(first).norm());
  }
  found.scatter = std::sqrt(squares);
  found.size = sum;
  if (found.scatter < 1e-9) {
    return std::nullopt;  // flags and constants: no sensor is without noise
  }
  return sum > 0.0 ? std::optional<SizeOfTriad>(found) : std::nullopt;
}

std::optional<GravityColumns> gravity_columns(const Values& values, const std::vector<Triad>& free, std::size_t samples,
                                              const std::vector<double>& intervals_s) {
  std::vector<Candidate> found;
  for (const Triad& triad : free) {
    const auto size = size_of_triad(values, triad, samples);
    if (size && size->scatter <= most_scatter_of_gravity) {
      found.push_back({triad, *size, gravity_unit(size->size, intervals_s)});
    }
  }
  // Columns of two triads side by side have a constant size at rest too; but they leave no gyros.
  const auto keep = [&found](auto&& good) {
    if (std::any_of(found.begin(), found.end(), good)) {
      std::erase_if(found, [&good](const Candidate& c) { return !good(c); });
    }
  };
  keep([](const Candidate& c) { return c.size.turned > turns; });
  keep([&](const Candidate& c) {
    return std::none_of(c.triad.begin(), c.triad.end(), [&](std::size_t k) { return is_constant(values[k]); });
  });
  std::vector<Candidate> sized;
  std::copy_if(found.begin(), found.end(), std::back_inserter(sized),
               [&](const Candidate& c) { return !c.unit.words.empty() && leaves_gyros(c.triad, free); });
  std::erase_if(found, [&](const Candidate& c) {
    return (c.unit.words.empty() || !leaves_gyros(c.triad, free)) &&
           std::any_of(sized.begin(), sized.end(),
                       [&c](const Candidate& other) { return overlap(c.triad, other.triad); });
  });
  // A magnetometer that was made one long has the size of a g, and none of 9.8 m/s^2.
  keep([&](const Candidate& c) { return c.unit.metres && leaves_gyros(c.triad, free); });
  constexpr double rests = 0.02;  // rad
  const bool at_rest =
      std::none_of(found.begin(), found.end(), [](const Candidate& c) { return c.size.turned > rests; });
  const auto best = std::min_element(found.begin(), found.end(), [&](const Candidate& a, const Candidate& b) {
    return a.unit.words.empty() != b.unit.words.empty() ? b.unit.words.empty()
           : at_rest                                    ? likeness(values, a.triad) > likeness(values, b.triad)
                                                        : a.size.scatter < b.size.scatter;
  });
  if (best == found.end()) {
    return std::nullopt;
  }
  return GravityColumns{
      best->triad,      best->size.scatter,        found.size(),
      best->unit.words, best->size.turned > rests, best->size.turned > rests && is_direction(values, best->triad)};
}

}  // namespace selfcal::import
