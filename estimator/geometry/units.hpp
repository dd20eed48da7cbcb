// Conversion factors between SI/radians (used everywhere inside) and the units people write.
// Multiply a quantity in the named unit by its factor to get SI: `bias_si = 100 * units::micro_g`.
#pragma once

#include <numbers>

namespace selfcal::units {

inline constexpr double degree = std::numbers::pi / 180.0;     // rad
inline constexpr double arcsecond = degree / 3600.0;           // rad
inline constexpr double hour = 3600.0;                         // s
inline constexpr double degree_per_hour = degree / hour;       // rad/s
inline constexpr double standard_gravity = 9.80665;            // m/s^2, ISO 80000-3
inline constexpr double micro_g = 1e-6 * standard_gravity;     // m/s^2
inline constexpr double ppm = 1e-6;                            // 1
inline constexpr double degree_per_sqrt_hour = degree / 60.0;  // rad/s/sqrt(Hz): angle random walk
inline constexpr double micro_g_per_sqrt_hz = micro_g;         // m/s^2/sqrt(Hz): velocity random walk

}  // namespace selfcal::units
