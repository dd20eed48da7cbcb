// Axes, signs and the gimbal's order and unit, by what turns, what gravity does meanwhile, and the Earth's rate.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "protocol/import/guess.hpp"
#include "protocol/import/import_map.hpp"
#include "protocol/import/motion.hpp"

namespace selfcal::import {

struct OrientationInput {
  TriadColumns gyro;
  TriadColumns accelerometer;
  const std::vector<double>* gimbal[2] = {};  // nullptr: none
  bool gimbal_named = false;                  // the first is called outer, the second inner
  std::string gimbal_unit;                    // as named; empty: not said
  std::optional<double> interval_s;
  std::optional<double> latitude_deg;
  bool axes_by_format = false;  // the file's format says how its axes lie
  bool on_a_table = false;      // a read-out of one axis shows what the gyros show
};

struct Orientation {
  Matrix3 gyro = Matrix3::Identity();  // v_b = matrix * v_file, a signed permutation
  Matrix3 accelerometer = Matrix3::Identity();
  std::array<double, 2> signs{1.0, 1.0};
  bool swapped = false;  // the gimbal's second column is the outer one
  bool moves = false;    // gimbal or hand
  bool turns = false;    // by the gyros, though gravity may not show it
  std::string gimbal_unit = "deg";
  std::optional<double> rad_per_sample;  // of a gyro's count
};

Orientation find_orientation(const OrientationInput& input, std::vector<Remark>& remarks);

// "x = -y, y = z, z = x"
std::string axes_words(const Matrix3& axes);

// The rows of AXES, each with one number that is not zero, as a map has them.
void set_axes(const Matrix3& axes, TriadMap& triad);

}  // namespace selfcal::import
