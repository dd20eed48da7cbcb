// A table that goes forth and back without a stop or a steady rate. Private to this folder.
//
//   (R5) over windows of L s   mean gyro = bias + response * (angle(t + L + d) - angle(t + d)) / L,   d: delay of the read-out
//
// A mean over a window is a difference of angles whatever the motion is, so that neither is differentiated.
#pragma once

#include <optional>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct Oscillation {
  ReadOutAxis axis;
  Vector3 bias, bias_sigma;                   // raw
  double delay_s = 0.0, delay_sigma_s = 0.0;  // by the axis that turns most
};

// nullopt: the read-out hardly moves, or what it does is less than nine tenths of what the gyros show.
std::optional<Oscillation> judge_oscillation(const PoseInput& input, bool outer);

}  // namespace selfcal::diagnosis
