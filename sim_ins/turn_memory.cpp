#include "sim_ins/turn_memory.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {
namespace {

constexpr double step_s = 0.01;

Vector3 load_at(double t, const TrueMotion& motion) { return motion.at(t).f_ib_b / units::standard_gravity; }

}  // namespace

Vector3 TurnMemory::change(double begin_s, double end_s, const TrueMotion& motion) {
  const GimbalMotion& gimbal = motion.gimbal();
  const bool turns = gimbal.turning(begin_s, end_s);
  if (of_ == Of::travel) {
    if (!turns) {
      return Vector3::Zero();
    }
    const GimbalState from = gimbal.at(begin_s), to = gimbal.at(end_s);
    return {std::abs(to.angle[0] - from.angle[0]) + std::abs(to.angle[1] - from.angle[1]), 0.0, 0.0};
  }
  if (!turns && motion.base_still()) {
    return Vector3::Zero();
  }
  const Vector3 before = load_;
  load_ = load_at(end_s, motion);
  return before - load_;
}

Vector3 TurnMemory::at(double t, const TrueMotion& motion) {
  const double place = std::max(0.0, t) / step_s;
  const auto before = static_cast<std::size_t>(place);
  if (memory_.empty()) {
    memory_.emplace_back(Vector3::Zero());
    load_ = load_at(0.0, motion);
  }
  const double kept = std::exp(-step_s / tau_s_);
  const double left = (1.0 - kept) * tau_s_ / step_s;  // at the end of a step, of what changes evenly over it
  while (memory_.size() < before + 2) {
    const double begin_s = static_cast<double>(memory_.size() - 1) * step_s;
    memory_.emplace_back(kept * memory_.back() + left * change(begin_s, begin_s + step_s, motion));
  }
  const double part = place - static_cast<double>(before);
  return (1.0 - part) * memory_[before] + part * memory_[before + 1];
}

}  // namespace selfcal::sim
