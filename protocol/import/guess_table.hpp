// A table with one axis: one column of angles, held against what the gyros show of its turns.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/import/guess_units.hpp"
#include "protocol/import/motion.hpp"

namespace selfcal::import {

struct TableAxis {
  Vector3 per_rad = Vector3::Zero();  // sum of the gyros' samples, in the file's units, over a radian of the read-out
  double explained = 0.0;             // share of the gyros' turns, squared, that follows the read-out
  int turns = 0;  // between two rests; 0: it turns all the time, and stretches of a second were compared
};

// ANGLE_UNIT: radians of one unit of ANGLE. SAMPLES: of a block. Nothing where the gyros or the read-out do not turn.
std::optional<TableAxis> table_axis(const TriadColumns& gyro, const TriadColumns& accel,
                                    const std::vector<double>& angle, double angle_unit, std::size_t samples);

// The read-out in a unit in which the gyros show its turns.
struct Table {
  std::string unit;
  TableAxis axis;
};
struct TableFit {
  std::vector<Table> ways;  // those that its name and the gyros' leave open, the likeliest first
  bool good = false;        // whether the gyros follow it, in whatever unit
  double explained = 0.0;   // at best
};
// CLAIMED: the unit that the column's name says, or none. GYROS: what theirs say.
TableFit fit_table(const TriadColumns& gyro, const TriadColumns& accel, const std::vector<double>& angle,
                   const std::string& claimed, const UnitClaim& gyros, std::optional<double> interval_s);

}  // namespace selfcal::import
