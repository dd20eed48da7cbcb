#include "estimator/diagnosis/effects/turn_memory.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {

// A jump d at time t leaves d exp(-(s - t)/tau) behind.
Vector3 TurnMemory::integral(double start_s, double end_s, double tau_s) const {
  constexpr double forgotten = 20.0;  // time constants: 2e-9 is left
  Vector3 sum = Vector3::Zero();
  for (auto turn = turns_.rbegin(); turn != turns_.rend(); ++turn) {
    const double last_s = turn->first_s + turn->step_s * static_cast<double>(turn->change.size());
    if (last_s < start_s - forgotten * tau_s) {
      break;
    }
    if (turn->first_s >= end_s) {
      continue;
    }
    if (last_s <= start_s) {  // over: what is left of all jumps at its end fades together
      const double kept = std::exp(-turn->step_s / tau_s);
      Vector3 left = Vector3::Zero();
      for (const Vector3& d : turn->change) {
        left = kept * (left + d);
      }
      sum += left * tau_s * (std::exp(-(start_s - last_s) / tau_s) - std::exp(-(end_s - last_s) / tau_s));
      continue;
    }
    double t = turn->first_s;
    for (const Vector3& d : turn->change) {
      if (t < end_s) {
        sum += d * tau_s * (std::exp(-std::max(0.0, start_s - t) / tau_s) - std::exp(-(end_s - t) / tau_s));
      }
      t += turn->step_s;
    }
  }
  return sum;
}

}  // namespace selfcal::diagnosis
