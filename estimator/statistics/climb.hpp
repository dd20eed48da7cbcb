// The top of a likelihood over a few positive quantities, by steps of a factor.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace selfcal {

struct Climb {
  std::vector<double> factors;  // one after the other, coarse to fine: the top is found to half of the last
  int most_rounds = 30;         // over all quantities, with one factor
  int most_moves = 1;   // along one quantity in a round: many follow a ridge along which two trade against each other
  double enough = 0.0;  // of the log likelihood: a round that gains no more is the factor's last
  double farthest = HUGE_VAL;  // by such a factor at most from where a quantity began
};

template <std::size_t N>
struct Summit {
  std::array<double, N> at;
  double log_likelihood = 0.0;
};

// From `start`, all positive, quantity by quantity.
template <std::size_t N>
Summit<N> climb(const std::array<double, N>& start, const Climb& how,
                const std::function<double(const std::array<double, N>&)>& log_likelihood) {
  Summit<N> best{start, log_likelihood(start)};
  const auto gains = [&](std::size_t k, double factor) {
    std::array<double, N> trial = best.at;
    trial[k] *= factor;
    if (std::abs(std::log(trial[k] / start[k])) > std::log(how.farthest)) {
      return false;
    }
    const double found = log_likelihood(trial);
    if (!(found > best.log_likelihood)) {
      return false;
    }
    best = {trial, found};
    return true;
  };
  for (const double factor : how.factors) {
    double before = -HUGE_VAL;
    for (int round = 0; round < how.most_rounds && best.log_likelihood > before + how.enough; ++round) {
      before = best.log_likelihood;
      for (std::size_t k = 0; k < N; ++k) {
        for (const double way : {factor, 1.0 / factor}) {
          int moves = 0;
          while (moves < how.most_moves && gains(k, way)) {
            ++moves;
          }
          if (moves > 0) {
            break;  // the top lies on this side
          }
        }
      }
    }
  }
  return best;
}

}  // namespace selfcal
