// Where the fit of an attitude begins: which reading of the file, by what lag, and which turns there are. Private to this folder.
//
// Over windows of 0.2 s the gyros' integral is a linear function of the attitude's rotation vector: int g = A phi + bias T, by least squares, for
// every reading and lag. The right reading is the one that the gyros follow best; another order of a quaternion or the other direction is
// no linear function of what the gyros show, unless all turns are about one axis.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/poses/attitude_rows.hpp"

namespace selfcal::diagnosis {

struct AttitudeStart {
  std::string failure;
  std::size_t reading = 0;
  std::vector<std::size_t> as_well;  // readings that fit no worse
  double explained = 0.0;            // share of the gyros' square
  AttitudeModel model;               // delay, W, seen, bias
  Vector3 turned = Vector3::Zero();  // rms rate times duration, rad, about the main axes of m, largest first
};

AttitudeStart find_start(const GyroTrack& track, const ReferenceAttitude& attitude, const Knots& knots);

}  // namespace selfcal::diagnosis
