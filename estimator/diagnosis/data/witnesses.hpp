// What gyros, accelerometers and gimbal read-outs each say of the same turns: the observations that are compared before
// any calibration. Private to this folder.
#pragma once

#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

struct GimbalAngles {
  double outer = 0.0, inner = 0.0;  // as read out
};

// One rotation, from a second before it to a second after it. Where the axes of the gyros are a mirror image of the right
// ones the increments turn the other way, and what many of them add up to has to be integrated apart.
// All rotation vectors are followed from sample to sample: half a turn has a sense, and more than that its length.
struct SensedTurn {
  Vector3 by_gyros;           // rotation vector of the increments, b as given
  Vector3 by_gyros_mirrored;  // of the increments' opposite
  Vector3 by_gimbal;          // of the read-outs; zero where there are none
  GimbalAngles from, to;
};

// One dwell without its first and last second.
struct SensedRest {
  Vector3 rate = Vector3::Zero(), force = Vector3::Zero();  // means, b as given: rad/s, m/s^2
  Matrix3
      C_ib = Matrix3::Identity(),
      C_ib_mirrored =
          Matrix3::Identity();  // at its middle, from where the recording starts, by the increments and their opposite
  double middle_s = 0.0;        // since the start
  double length_s = 0.0;
  GimbalAngles angles;  // at its middle; zero where there are no read-outs
};

struct Witnesses {
  bool gimbal = false;  // there are read-outs
  std::vector<SensedTurn> turns;
  std::vector<SensedRest> rests;
};

// `drift` (rad/s) is taken from the gyros before they are integrated.
Witnesses gather_witnesses(const ImuData& data, const std::vector<Segment>& segments,
                           const Vector3& drift = Vector3::Zero());

}  // namespace selfcal::diagnosis
