// The six families of effects. An effect stands in one of them: a row and an equation.
#pragma once

#include <vector>

#include "estimator/diagnosis/effects/effect.hpp"

namespace selfcal::diagnosis {

std::vector<Effect> thermal_effects();
std::vector<Effect> accelerometer_effects();
std::vector<Effect> gyro_effects();
std::vector<Effect> mounting_effects();
std::vector<Effect> base_effects();
std::vector<Effect> after_turn_effects();

// A bias that warms up, temperature not measured: effects of their own, and what a drift in time leaves some of.
Effect accel_warm_up();
Effect gyro_warm_up();

// What an accelerometer errs with by the squares of the other axes, two an accelerometer, and by that of its own.
bool has_squares_of_others(const Effect& effect);
bool has_square_of_own(const Effect& effect);

}  // namespace selfcal::diagnosis
