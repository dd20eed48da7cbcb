// The units in which people write what an IMU says, and what each is in SI.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace selfcal::import {

enum class Quantity { angular_rate, angle, acceleration, velocity, time, temperature };

struct Unit {
  std::string_view name;  // as a map writes it
  Quantity quantity;
  double si;  // value_si = value * si; rad, m, s. Temperatures: see celsius()
};

// The units of gyros (rates and increments), accelerometers, time.
std::span<const Unit> known_units();
std::optional<Unit> find_unit(std::string_view name);

// "C", "K", "F"
double celsius(double value, std::string_view unit);

}  // namespace selfcal::import
