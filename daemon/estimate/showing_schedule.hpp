// The schedule of a further recording that would show an effect which this one shows too weakly or not at all.
#pragma once

#include <optional>
#include <string>

#include "estimator/geometry/schedule.hpp"
#include "estimator/passes/calibration.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

struct ShowingSchedule {
  std::string words;  // how it differs from the schedule before
  Schedule schedule;
};

// `experiment`: the words of the catalogue (diagnosis::Finding::experiment), `done`: the schedule of the recording.
// Nothing where the schedule alone would not do: another channel, another place or heading of the host.
std::optional<ShowingSchedule> showing_schedule(const std::string& experiment, const Schedule& done);

// The same positions and one half way through each turn: what is not in the catalogue shows there as anywhere new.
ShowingSchedule dwells_between(const Schedule& done);

// The schedule that the recording followed, at the angles that the gimbal reached (its read-outs).
Schedule schedule_of(const Recording& recording, const ImuData& data);

}  // namespace selfcal
