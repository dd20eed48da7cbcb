// A rotation of great merit, searched among those that the gimbal can make: the best of a few drawn at random, changed position
// by position and dwell by dwell while that helps. The same for the same merit.
#pragma once

#include <functional>
#include <stop_token>

#include "estimator/discovery/planned_rotation.hpp"

namespace selfcal::discovery {

struct RatedPlan {
  Schedule plan;  // no positions: none was better than nothing
  double merit = 0.0;
};

// `merit` is 1 at most, `merit_now` that of no rotation. Short rotations are tried first: the first that gains nine tenths of
// what could be gained is taken, else the best, where a longer one has to be clearly better. No longer than limits.duration_s.
RatedPlan search_plan(const ExperimentLimits& limits, double merit_now,
                      const std::function<double(const Schedule&)>& merit, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
