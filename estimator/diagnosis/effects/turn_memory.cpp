#include "estimator/diagnosis/effects/turn_memory.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace selfcal::diagnosis {

TurnMemory::TurnMemory(const std::vector<TurnChanges>& turns) {
  std::vector<std::pair<double, Vector3>> jumps;
  for (const TurnChanges& turn : turns) {
    for (std::size_t k = 0; k < turn.change.size(); ++k) {
      jumps.emplace_back(turn.first_s + turn.step_s * static_cast<double>(k), turn.change[k]);
    }
  }
  std::stable_sort(jumps.begin(), jumps.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [time_s, jump] : jumps) {
    time_s_.push_back(time_s);
    jump_.push_back(jump);
  }
}

const std::vector<Vector3>& TurnMemory::after_jumps(double tau_s) const {
  constexpr std::size_t most_constants = 32;  // of the grids of a pass; a fit asks for one after the other
  const auto known = after_jumps_.find(tau_s);
  if (known != after_jumps_.end()) {
    return known->second;
  }
  if (after_jumps_.size() >= most_constants) {
    after_jumps_.clear();
  }
  std::vector<Vector3>& after = after_jumps_[tau_s];
  after.reserve(jump_.size());
  Vector3 y = Vector3::Zero();
  for (std::size_t k = 0; k < jump_.size(); ++k) {
    y = (k == 0 ? Vector3::Zero() : Vector3(y * std::exp(-(time_s_[k] - time_s_[k - 1]) / tau_s))) + jump_[k];
    after.push_back(y);
  }
  return after;
}

// y fades from the last jump before start_s on; each jump within the stretch adds its own.
Vector3 TurnMemory::integral(double start_s, double end_s, double tau_s) const {
  const std::vector<Vector3>& after = after_jumps(tau_s);
  auto k = static_cast<std::size_t>(std::upper_bound(time_s_.begin(), time_s_.end(), start_s) - time_s_.begin());
  Vector3 sum = Vector3::Zero();
  if (k > 0) {
    const double last_s = time_s_[k - 1];
    sum = after[k - 1] * tau_s * (std::exp(-(start_s - last_s) / tau_s) - std::exp(-(end_s - last_s) / tau_s));
  }
  for (; k < jump_.size() && time_s_[k] < end_s; ++k) {
    sum += jump_[k] * tau_s * (1.0 - std::exp(-(end_s - time_s_[k]) / tau_s));
  }
  return sum;
}

}  // namespace selfcal::diagnosis
