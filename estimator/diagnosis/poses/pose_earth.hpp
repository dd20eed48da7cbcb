// The Earth's rate in static poses whose heading nobody measured. Private to this folder.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct EarthInPoses {
  std::vector<Vector3> rate;  // of each pose, sensor axes, raw units; zero where the latitude is not known
  bool reversed =
      false;  // whether it turns the other way about u: accelerometers that read acceleration, no specific force
  std::optional<double>
      latitude;  // rad: as the readings show it where nobody says it, or by e^8 likelier than what is told
  double latitude_sigma = 0.0;  // rad
  bool heading = false;         // whether the readings show the heading: likelier by e^6 than without a horizontal part
};

// The vertical part, Omega sin L along the calibrated u, is known where the latitude is; where it is not, as the readings show it. The horizontal part, Omega cos L, points to a north
// that one heading makes known in all poses, for the gyros carry it through the turns. That it is there needs no proof: the likeliest
// heading is taken, whether it shows or not. `carried`: whether no turn between poses was clipped or left out; otherwise the
// horizontal part is left to what the poses scatter by.
// Accelerometers that all are reversed turn u over, which no turn shows: where the readings are likelier so by e^6, they are.
EarthInPoses earth_in_poses(const PoseInput& input, const std::vector<Pose>& poses, bool carried);

// Names of the gyros that it may make (PoseEffect::may_be_earth).
void mark_earth(const PoseInput& input, PoseDiagnosis& d);

}  // namespace selfcal::diagnosis
