// How much later than the gyros the read-outs of the gimbal show a turn. Positions are named by them, nothing is estimated from them:
// a delay costs the 24 nothing, but whoever takes an attitude from them needs it.
#pragma once

#include <optional>
#include <vector>

#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

struct ReadOutDelay {
  double delay_s = 0.0;  // positive: they come after the gyros
  double sigma_s = 0.0;  // of the mean, by how single turns differ
};

// nullopt: no read-outs, fewer than three turns in which both axes' rates and the gyros' are one motion, or no delay of a sample and a half and
// five sigma. At most 1.5 s are looked for.
std::optional<ReadOutDelay> read_out_delay(const ImuData& data, const std::vector<Segment>& segments);

}  // namespace selfcal::diagnosis
