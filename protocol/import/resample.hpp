// A recording onto a uniform grid of its own sample rate, for times that jitter.
#pragma once

#include <string>

#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::import {

// Increments are summed, the sums interpolated linearly at the grid's times, and differenced: no rotation and no velocity
// is lost or made. Angles (whichever way round is shorter) and temperatures are interpolated linearly. The grid begins at the
// first sample's end. Returns what was done, with the number of samples before and after and the furthest shift.
// An error (bad_input) where gaps would make the grid twice as long as the recording: it cannot be meant.
Expected<std::string> resample(Recording& recording);

}  // namespace selfcal::import
