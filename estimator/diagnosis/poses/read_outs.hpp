// Angle read-outs as a reference: what the gyros make of turns about a table's axes, and how gravity turns in the sensor. Private to
// this folder; what it answers stands in poses.hpp.
//
// The read-outs' clock is not the sensors' one. Turns are therefore taken from stop to stop and steady rates in their middle,
// where a delay changes nothing, and the delay is estimated turn by turn:
//   (R1) from stop to stop   int (g - bias) dt = response * turn, one axis at a time, the outer one at one inner angle
//   (R2) at a steady rate    g = bias + response * rate
//   (R3) delay of a turn     centre in time of the read-out's turn less that of the gyros' turn
//        of a step of rate   (turn by the gyros - turn by the read-out) / step, over the step
//   (R4) at stops, one axis turning by t:  f = c + p cos t + q sin t;  an axis near the vertical leans by |p|/g
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"

namespace selfcal::diagnosis {

// nullopt: there are no read-outs, or no turn that they and the gyros show.
// `clipped`: the ends of ranges that are reached; turns and rates in which a gyro stands there tell nothing of it.
std::optional<ReadOuts> judge_read_outs(const PoseInput& input, const std::vector<Pose>& poses,
                                        const std::vector<Clipping>& clipped, double alpha);

// None where the gyros, whose unit is known, turn by another size than the read-outs: nothing follows from them then, and `invisible` tells it.
std::optional<ReadOuts> read_outs_of(const PoseInput& input, const std::vector<Pose>& poses,
                                     const std::vector<Clipping>& clipped, double alpha,
                                     std::vector<std::string>& invisible);

}  // namespace selfcal::diagnosis
