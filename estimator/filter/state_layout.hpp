// The one table of the state vector (33 states). Positions are carried as lengths, so that all of the dynamic part
// is in metres, metres per second and radians:
//   dp = ((R_M+h) dL, dh, (R_N+h) cos L dlambda) | dv n u e | phi n u e | observation states | biases | 24 parameters | extra
// phi: C_computed = (I - [phi x]) C_true. Parameters: truth minus the values the navigation compensates with.
// Observation states (coloured motion of a moored base), biases (what wanders about a constant one) and extra parameters
// (diagnosis) may be absent.
#pragma once

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal {

struct StateLayout {
  static constexpr int position = 0;
  static constexpr int velocity = 3;
  static constexpr int attitude = 6;
  static constexpr int navigation_count = 9;

  int observation_count = 0;
  int bias_count = 0;
  int extra_count = 0;
  int turn_count = 0;  // three for each turn that the gyros did not see, where a pass has them as constants

  int observation() const { return navigation_count; }
  int biases() const { return navigation_count + observation_count; }
  int dynamic_count() const { return biases() + bias_count; }
  int parameters() const { return dynamic_count(); }
  int turns() const { return parameters() + sensor_parameter_count + extra_count; }
  int constant_count() const { return sensor_parameter_count + extra_count + turn_count; }
  int count() const { return dynamic_count() + constant_count(); }
};

}  // namespace selfcal
