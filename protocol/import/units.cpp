#include "protocol/import/units.hpp"

#include <algorithm>
#include <array>

#include "estimator/geometry/units.hpp"

namespace selfcal::import {
namespace {

using units::arcsecond;
using units::degree;
using units::hour;
constexpr double g = units::standard_gravity;
constexpr double foot = 0.3048;  // m, international

constexpr std::array<Unit, 38> table{{
    {"rad/s", Quantity::angular_rate, 1.0},
    {"deg/s", Quantity::angular_rate, degree},
    {"deg/h", Quantity::angular_rate, degree / hour},
    {"mrad/s", Quantity::angular_rate, 1e-3},
    {"rad/h", Quantity::angular_rate, 1.0 / hour},
    {"arcsec/s", Quantity::angular_rate, arcsecond},
    {"mdeg/s", Quantity::angular_rate, 1e-3 * degree},
    {"rpm", Quantity::angular_rate, 6.0 * degree},
    {"rev/s", Quantity::angular_rate, 360.0 * degree},
    {"rad", Quantity::angle, 1.0},
    {"deg", Quantity::angle, degree},
    {"arcsec", Quantity::angle, arcsecond},
    {"arcmin", Quantity::angle, 60.0 * arcsecond},
    {"mrad", Quantity::angle, 1e-3},
    {"urad", Quantity::angle, 1e-6},
    {"m/s^2", Quantity::acceleration, 1.0},
    {"g", Quantity::acceleration, g},
    {"mg", Quantity::acceleration, 1e-3 * g},
    {"ug", Quantity::acceleration, 1e-6 * g},
    {"ft/s^2", Quantity::acceleration, foot},
    {"cm/s^2", Quantity::acceleration, 1e-2},
    {"mm/s^2", Quantity::acceleration, 1e-3},
    {"mGal", Quantity::acceleration, 1e-5},
    {"m/s", Quantity::velocity, 1.0},
    {"g*s", Quantity::velocity, g},
    {"mg*s", Quantity::velocity, 1e-3 * g},
    {"ug*s", Quantity::velocity, 1e-6 * g},
    {"mm/s", Quantity::velocity, 1e-3},
    {"cm/s", Quantity::velocity, 1e-2},
    {"ft/s", Quantity::velocity, foot},
    {"s", Quantity::time, 1.0},
    {"ms", Quantity::time, 1e-3},
    {"100us", Quantity::time, 1e-4},
    {"us", Quantity::time, 1e-6},
    {"ns", Quantity::time, 1e-9},
    {"min", Quantity::time, 60.0},
    {"h", Quantity::time, hour},
    {"d", Quantity::time, 24.0 * hour},
}};

}  // namespace

std::span<const Unit> known_units() { return table; }

std::optional<Unit> find_unit(std::string_view name) {
  const auto* const found = std::find_if(table.begin(), table.end(), [&](const Unit& u) { return u.name == name; });
  return found == table.end() ? std::nullopt : std::optional<Unit>(*found);
}

double celsius(double value, std::string_view unit) {
  if (unit == "K") {
    return value - 273.15;
  }
  return unit == "F" ? (value - 32.0) / 1.8 : value;
}

}  // namespace selfcal::import
