// What the true motion leaves behind for minutes: of the load on the sensors, of the heat of the gimbal's motors.
#pragma once

#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "sim_ins/true_motion.hpp"

namespace selfcal::sim {

// y' = x' - y/tau, y = 0 at time 0. Known at the ends of steps of 10 ms, which are computed as they are asked for, and straight between
// them: within a step x changes evenly to 1e-5 of a turn's change.
class TurnMemory {
 public:
  // x: -u, g, b axes; or the angle travelled by both axes of the gimbal, rad, first element.
  enum class Of { load, travel };
  TurnMemory(Of of, double tau_s) : of_(of), tau_s_(tau_s) {}

  // y at time t >= 0. The same motion at every call.
  Vector3 at(double t, const TrueMotion& motion);

 private:
  Vector3 change(double begin_s, double end_s, const TrueMotion& motion);  // of x, steps in order of time

  Of of_;
  double tau_s_;
  std::vector<Vector3> memory_;  // at the ends of the steps
  Vector3 load_ = Vector3::Zero();
};

}  // namespace selfcal::sim
