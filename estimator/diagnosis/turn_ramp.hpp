// How a recording's gimbal turns, for rotations that it has not made yet: what follows a rate or its square acts by it.
#pragma once

#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

// The rate of a turn rises as 1 - cos over its first part, stands, and falls over its last one. Share of the turn's time that each of the
// two takes, 0 to 0.5: the median over the turns. 0.5, a turn that never has a steady rate, where nothing turns.
//
// With q = integral of w^2 dt / (peak * integral of w dt) it is (1 - q) / (1.25 - q): the ramps hold 3/8 of the square and 1/2 of the
// angle that a steady rate would. Where a turn begins and ends plays no part.
double turn_ramp(const ImuData& data);

}  // namespace selfcal::diagnosis
