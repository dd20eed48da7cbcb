// Jumps of the accelerometers' integral: a count that electronics lose, a knock. Noise of one density makes none of their size.
//
// A jump within an interval changes all innovations behind it. One pass backwards over what the filter did gives the score and the
// information of a jump in every interval at once (disturbance smoother: de Jong and Penzer, J. Am. Stat. Assoc. 93, 1998).
#pragma once

#include <vector>

#include "estimator/models/segments.hpp"
#include "estimator/passes/pass.hpp"

namespace selfcal::diagnosis {

struct VelocityJump {
  double start_s = 0.0, end_s = 0.0;  // of the interval
  Vector3 size_b = Vector3::Zero();   // m/s, along the sensors' axes
  Vector3 sigma_b = Vector3::Zero();
  double chi2 = 0.0;  // of three degrees of freedom
};

// Of every interval that was observed, as if it were the only one.
std::vector<VelocityJump> jumps_by_interval(const PassInput& input);

// Intervals in which the velocity jumps by more than the noise makes once in 10^5, within 5 s of such a one once in 10^3: there the filter's
// velocity is opened. In turns and up to
// 15 s behind them only as many are believed as the rest of the dwells makes likely, for there effects are at home; what stands in
// turns alone is none. More than one in 30 intervals are none either: noise of another kind. Chronological.
// `opened`: that are open already, and among those returned.
std::vector<VelocityJump> open_velocity_jumps(PassInput& input, const std::vector<Segment>& segments,
                                              std::vector<VelocityJump> opened = {});

}  // namespace selfcal::diagnosis
