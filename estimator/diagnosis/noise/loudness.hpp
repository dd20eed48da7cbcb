// How loud a base is, interval by interval: people in a vehicle, wind, an engine. The gyros tell it by what they change by from quarter to
// quarter of an interval, which neither a bias nor an effect of the catalogue does.
#pragma once

#include <vector>

#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

struct Loudness {
  double start_s = 0.0, end_s = 0.0;
  double power = 0.0;  // mean square of the changes, over the median of the recording
};

// Of every interval of `interval_s` from the beginning. A turn changes the rates by itself, were it by the Earth's rate alone: there it is the
// mean of the intervals on both sides. Empty: too short to tell.
std::vector<Loudness> loudness_of(const ImuData& data, const std::vector<Segment>& segments, double interval_s);

// Whether it changes by more than noise of one density would make it: white noise does not come to 12 times its median once in 10^9.
bool changes_its_loudness(const std::vector<Loudness>& all);

}  // namespace selfcal::diagnosis
