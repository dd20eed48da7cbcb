// What the turns of a recording leave behind for minutes: of the load that they changed, of the heat of the motors.
#pragma once

#include <map>
#include <vector>

#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

// How a quantity x changed over a turn: in jumps, evenly spaced in time.
struct TurnChanges {
  double first_s = 0.0,
         step_s = 0.0;  // time of the first jump and from one to the next, s since the start of the recording
  std::vector<Vector3> change;
};

// A memory y of x that fades: y' = x' - y/tau, y = 0 before the first turn. It keeps what it worked out for the time constants that it was
// asked for last: not to be shared among threads.
class TurnMemory {
 public:
  explicit TurnMemory(const std::vector<TurnChanges>& turns);

  // Integral of y over [start_s, end_s].
  Vector3 integral(double start_s, double end_s, double tau_s) const;

 private:
  // y right after each jump.
  const std::vector<Vector3>& after_jumps(double tau_s) const;

  std::vector<double> time_s_;  // of the jumps of all turns, in order
  std::vector<Vector3> jump_;
  mutable std::map<double, std::vector<Vector3>> after_jumps_;  // by time constant
};

}  // namespace selfcal::diagnosis
