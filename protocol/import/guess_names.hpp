// What the names of columns say: which quantity, which axis, which unit. Names are claims, which the numbers then check.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace selfcal::import {

enum class Role { unknown, time, counter, gyro, accelerometer, outer, inner, gimbal, temperature, other };

struct NamedColumn {
  Role role = Role::unknown;
  int axis = -1;           // 0 1 2 for x y z
  bool increment = false;  // the name says so
  std::string unit;        // of units.hpp, "C" "K" "F", "date"; empty: none said
  std::string
      other_unit;  // what the name says instead of a known unit: a time's "ticks", "0.1 ms"; a triad's "in/s^2"; empty: nothing so
};

// NAME without or with a unit ("gx [deg/s]", "acc_x_m_s2"); UNIT from a line of units, may be empty.
NamedColumn read_name(std::string_view name, std::string_view unit);

// As people write units, to as units.hpp does ("m.s^-2", "dps"); empty: none that is known.
std::string known_unit(std::string_view written);

// Columns that are named so, without increments where rates stand beside them: the first x, y and z, the second ones, and so on.
struct NamedTriads {
  std::vector<std::array<std::size_t, 3>> all;
  std::size_t most = 0;  // columns of the axis that has most
};
NamedTriads triads_by_name(const std::vector<NamedColumn>& named, Role role);

// Of several triads that stand side by side that which the sensor itself gives: the only one that is called raw or uncalibrated, or the only one
// that is not called calibrated, corrected or filtered. Nothing: names do not tell.
std::optional<std::size_t> raw_one_of(const std::vector<std::string>& names,
                                      const std::vector<std::array<std::size_t, 3>>& triads);

std::vector<NamedColumn> read_names(const std::vector<std::string>& names, const std::vector<std::string>& units);

}  // namespace selfcal::import
