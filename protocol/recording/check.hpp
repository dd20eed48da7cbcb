// What makes a recording usable: everything the format demands of the values, apart from how they are stored.
#pragma once

#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// A finding about data that is only suspect; the text names dataset, row and value.
struct LoadedRecording {
  Recording recording;
  std::vector<std::string> warnings;
};

// What a reader may let pass with a warning. The default is what an estimate needs; a diagnosis, which looks for
// data faults, relaxes it.
struct CheckPolicy {
  bool gaps_are_errors = true;
  bool gimbal_contradiction_is_error = true;
  bool uneven_force_is_error = true;  // mean specific force unlike gravity, that of half of the seconds like it
};

// Checks values: finite, time increasing, no gaps (an interval above 1.5 nominal ones), mean rate within 0.1 % of
// sample_rate_hz, site in range, equal lengths, specific force of the size of gravity, and the gimbal read-outs
// against the rotation that the gyros integrate to. Returns warnings; an error names dataset, row and value.
Expected<std::vector<std::string>> check_recording(const Recording& recording, const CheckPolicy& policy = {});

}  // namespace selfcal
