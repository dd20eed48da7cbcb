// What the numbers of an unknown instrument show of its motion: blocks, rests, turns. Units are the file's.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "estimator/geometry/rotation.hpp"

namespace selfcal::import {

// A quarter of a second or so.
struct Block {
  Vector3 gyro = Vector3::Zero();   // sum of the samples
  Vector3 accel = Vector3::Zero();  // mean
  std::array<double, 2> from{};     // gimbal read-outs, unwrapped, rad, at its begin and its end
  std::array<double, 2> to{};
  std::size_t row = 0;  // its first
  bool quiet = false;   // neither gyros nor gimbal turn
};

struct Motion {
  std::vector<Block> blocks;
  std::size_t samples = 0;         // of a block
  Vector3 bias = Vector3::Zero();  // what the gyros read at rest, per sample: median of the quiet blocks
  bool turns = false;
  bool has_gimbal = false;
};

struct TriadColumns {
  const std::vector<double>* column[3] = {};
  Vector3 at(std::size_t row) const { return {(*column[0])[row], (*column[1])[row], (*column[2])[row]}; }
};

// GIMBAL: outer and inner in rad, or nothing. SAMPLES: of a block.
Motion find_motion(const TriadColumns& gyro, const TriadColumns& accel,
                   const std::optional<std::array<std::vector<double>, 2>>& gimbal, std::size_t samples);

// A time between two turns, and a turn between two of those.
struct Rest {
  std::size_t first = 0, last = 0;  // blocks, half open
  Vector3 accel = Vector3::Zero();
  Vector3 gyro = Vector3::Zero();  // per sample
  std::array<double, 2> gimbal{};
};
struct Turn {
  Vector3 gyro = Vector3::Zero();  // sum of the samples, bias taken off
  std::array<double, 2> from{};
  std::array<double, 2> by{};  // of the read-outs
};
std::vector<Rest> rests_of(const Motion& motion);
// Centre of the sphere on which the specific forces at rest lie, if it is far from zero (a fifth of the radius) and six
// directions or more fix it: counts of a converter that has its zero in the middle of its range.
std::optional<Vector3> centre_of_gravity_sphere(const TriadColumns& gyro, const TriadColumns& accel);
std::vector<Turn> turns_of(const Motion& motion, const std::vector<Rest>& rests);

// The least of three gyros' largest deviation over what a block usually deviates by: a gyro turns and rests.
double least_contrast(const Motion& motion);

// Size of the specific force over a few samples, the median of all: gravity's, of a sensor that mostly stands or is turned by hand.
double usual_force(const TriadColumns& accel);

}  // namespace selfcal::import
