// The Earth's rate in poses whose headings nothing connects: a file each, no turn between them. Private to this folder.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

struct FreeHeadings {
  Vector3 bias, sigma;          // raw
  double noise = 0.0;           // what is left of a reading, raw
  double latitude = 0.0;        // rad: as told, or where nobody says it as the readings show it
  double latitude_sigma = 0.0;  // rad; 0: told
  std::optional<double> seen;   // rad: as the readings show it where they contradict what is told
  bool reversed = false;        // whether the Earth turns the other way about u
};

// y_k = b + Omega (sin L u_k + cos L n_k) with a horizontal n_k of any heading in each pose: of three readings a pose two say something of b,
// e = u.r - Omega sin L and |r - u (u.r)| - Omega cos L with r = y - b. nullopt: fewer than six poses, directions that leave a bias open, or gyros
// whose readings this leaves more than a tenth of the Earth's rate of.
std::optional<FreeHeadings> bias_by_free_headings(const PoseInput& input, const std::vector<Pose>& poses);

// The poses with the Earth's rate taken out of the gyros' means: beside a sensor that sees it, it goes with the pose as a
// g-sensitivity does.
std::vector<Pose> without_earth(const PoseInput& input, const std::vector<Pose>& poses,
                                const std::vector<std::size_t>& usable, PoseDiagnosis& d);

// Poses between which no turn is carried, of gyros that see the Earth: each has a heading of its own, which the Earth's rate shows. What goes with
// the pose stands with those headings.
bool judge_free_headings(const PoseInput& input, const std::vector<Pose>& poses, const std::vector<std::size_t>& turns,
                         PoseDiagnosis& d);

// Few headings, as of a sensor that is turned about the vertical by quarters: where the gyros carry the heading and see the Earth's rate, it
// is taken out of their means, and what is left is their bias.
void add_bias_by_headings(const PoseInput& input, std::vector<Pose> poses, PoseDiagnosis& d);

}  // namespace selfcal::diagnosis
