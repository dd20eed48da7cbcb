// What the turns of a recording leave behind for minutes: of the load that they changed, of the heat of the motors.
#pragma once

#include <utility>
#include <vector>

#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

// How a quantity x changed over a turn: in jumps, evenly spaced in time.
struct TurnChanges {
  double first_s = 0.0,
         step_s = 0.0;  // time of the first jump and from one to the next, s since the start of the recording
  std::vector<Vector3> change;
};

// A memory y of x that fades: y' = x' - y/tau, y = 0 before the first turn.
class TurnMemory {
 public:
  // In order of time.
  explicit TurnMemory(std::vector<TurnChanges> turns) : turns_(std::move(turns)) {}

  // Integral of y over [start_s, end_s].
  Vector3 integral(double start_s, double end_s, double tau_s) const;

 private:
  std::vector<TurnChanges> turns_;
};

}  // namespace selfcal::diagnosis
