// Which three columns without names are accelerometers: gravity has the same size in whatever attitude.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocol/import/guess_roles.hpp"

namespace selfcal::import {

using Triad = std::array<std::size_t, 3>;

struct SizeOfTriad {
  double scatter = 0.0;  // of the size of a block's mean, in parts of it
  double size = 0.0;     // mean
  double turned = 0.0;   // sine of the largest angle from the first block's direction
};
constexpr double most_scatter_of_gravity = 0.05;  // of its size

// SAMPLES: of a block. Nothing of fewer than eight blocks, and of columns without any noise.
std::optional<SizeOfTriad> size_of_triad(const Values& values, const Triad& triad, std::size_t samples);

struct GravityColumns {
  Triad triad{};
  double scatter = 0.0;
  std::size_t alike = 0;      // sets that may be accelerometers as well, this one among them
  std::string words;          // what it is that its size is; empty: of no unit that is known
  bool moves = false;         // their direction changes, so that gyros are to be seen beside them
  bool is_direction = false;  // their size has no noise
};
// Root of the mean square of the second differences from row to row, as of white noise.
double row_noise(const std::vector<double>& values);

// The likeliest of FREE, of those at rest that whose columns are most alike in noise. INTERVALS_S: those that the time may mean, by which increments of a velocity have gravity's size. Of sets of a constant
// size one that has gravity's own, and beside which three columns for gyros are left, is taken before others; those that share a column with it are
// none.
std::optional<GravityColumns> gravity_columns(const Values& values, const std::vector<Triad>& free, std::size_t samples,
                                              const std::vector<double>& intervals_s);

// Of FREE, which is not empty, that which stands nearest to zero beside its noise, none of its columns still: what gyros at rest do.
Triad nearest_zero(const Values& values, const std::vector<Triad>& free);

// Whether a column has one value throughout.
bool is_constant(const std::vector<double>& values);

}  // namespace selfcal::import
