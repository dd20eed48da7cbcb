#include "estimator/fleet/jumps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace selfcal::fleet {
namespace {

constexpr double sigmas_needed = 4.0;
constexpr std::size_t least_blocks = 100;
constexpr int settled_after = 4;         // measurements before a unit's first block
constexpr int measurements_a_block = 4;  // at least
constexpr std::size_t jump_times = 6;    // at which w is taken, over a block

// Expected values, which a filter of given gains carries forward. Of the unit, or of what it makes of a jump of 1.
struct Expectation {
  double level = 0.0, ramp = 0.0, returning = 0.0;
  double value() const { return level + returning; }
  void advance(double years, double kept) {
    level += years * ramp;
    returning *= kept;
  }
  void take(const std::array<double, 3>& gain, double innovation) {
    level += gain[0] * innovation;
    ramp += gain[1] * innovation;
    returning += gain[2] * innovation;
  }
};

struct Block {
  double z = 0.0;       // d by its sigma
  double excess = 0.0;  // of the mean of z^4, for lambda s^4 = 1
};

// One unit's blocks of at least so many years, one behind the other.
class Blocks {
 public:
  Blocks(const TypeModel& model, double years, std::vector<Block>& found)
      : model_(&model),
        years_(years),
        found_(&found),
        covariance_(model),
        forecast_covariance_(model),
        expected_{model.mean, model.ramp_per_year, model.settling} {}

  void follow(const UnitHistory& unit) {
    year_ = unit.front().year;
    int seen = 0;
    for (const Measurement& m : unit) {
      take(m);
      ++inside_;
      const bool first = ++seen == settled_after;
      const bool ends = seen > settled_after && inside_ >= measurements_a_block && m.year - begun_ >= years_;
      if (ends) {
        note();
      }
      if (first || ends) {
        begin();
      }
    }
  }

 private:
  void take(const Measurement& m) {
    const double years = m.year - year_;
    year_ = m.year;
    const double kept = covariance_.advance(years);
    forecast_covariance_.advance(years);
    const SetOffset& set = model_->sets[static_cast<std::size_t>(m.set)];
    const double noise = model_->setup_sd * model_->setup_sd + m.sigma * m.sigma + set.sigma * set.sigma;
    const auto gain = covariance_.take(noise);
    forecast_.advance(years, kept);
    expected_.advance(years, kept);
    expected_.take(gain, m.value - set.value - expected_.value());
    for (std::size_t k = 0; k < jump_times; ++k) {
      const double jumped_at = begun_ + (static_cast<double>(k) + 0.5) / static_cast<double>(jump_times) * years_;
      of_jump_[k].advance(years, kept);
      of_jump_[k].take(gain, (year_ >= jumped_at ? 1.0 : 0.0) - of_jump_[k].value());
    }
  }

  void begin() {
    begun_ = year_;
    inside_ = 0;
    forecast_covariance_ = covariance_;
    forecast_ = expected_;
    of_jump_.fill({});
  }

  void note() {
    const double variance = forecast_covariance_.variance() - covariance_.variance();
    if (!(variance > 0.0)) {
      return;
    }
    double fourth = 0.0;
    for (const Expectation& seen : of_jump_) {
      fourth += std::pow(seen.value(), 4) / static_cast<double>(jump_times);
    }
    found_->push_back(
        {(expected_.value() - forecast_.value()) / std::sqrt(variance), 3.0 * years_ * fourth / (variance * variance)});
  }

  const TypeModel* model_;
  double years_;
  std::vector<Block>* found_;
  UnitCovariance covariance_, forecast_covariance_;
  Expectation expected_, forecast_;
  std::array<Expectation, jump_times> of_jump_;
  double year_ = 0.0, begun_ = HUGE_VAL;
  int inside_ = 0;
};

struct Excess {
  double value = 0.0, sigma = HUGE_VAL;  // of lambda s^4
};

// Least squares of z^4 over its normal mean, whose own scatter is that of a normal z (24: with the variance taken from the sample).
Excess excess_of(const std::vector<Block>& blocks) {
  double squares = 0.0, weight = 0.0, sum = 0.0;
  for (const Block& block : blocks) {
    squares += block.z * block.z;
  }
  const double mean_square = squares / static_cast<double>(blocks.size());
  for (const Block& block : blocks) {
    sum += block.excess * (std::pow(block.z, 4) - 3.0 * mean_square * mean_square);
    weight += block.excess * block.excess;
  }
  return weight > 0.0 ? Excess{sum / weight, std::sqrt(24.0 / weight) * mean_square * mean_square} : Excess{};
}

double usual_step(std::span<const UnitHistory> units) {
  std::vector<double> steps;
  for (const UnitHistory& unit : units) {
    for (std::size_t k = 1; k < unit.size(); ++k) {
      steps.push_back(unit[k].year - unit[k - 1].year);
    }
  }
  if (steps.empty()) {
    return 0.0;
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

Jumps jumps_of(std::span<const UnitHistory> units, const TypeModel& model) {
  const double step = usual_step(units);
  Excess best;
  for (const double steps : {4.0, 8.0, 16.0, 32.0}) {
    std::vector<Block> blocks;
    for (const UnitHistory& unit : units) {
      if (!unit.empty()) {
        Blocks(model, steps * step, blocks).follow(unit);
      }
    }
    if (blocks.size() >= least_blocks) {
      const Excess found = excess_of(blocks);
      best = found.sigma < best.sigma ? found : best;
    }
  }
  const double q = model.walk_sd * model.walk_sd;
  if (!(q > 0.0) || !(best.value > sigmas_needed * best.sigma)) {
    return {};
  }
  // A sigma more than found: what leaves a limit rests on the rare ones, and too few of them cost more than too many.
  const double variance = (best.value + best.sigma) / q;
  return {q / variance, std::sqrt(variance)};
}

}  // namespace selfcal::fleet
