// Where no name explains a recording: the bias that each dwell shows against the 24, for people to see the pattern.
#pragma once

#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::cli {

// A row for each dwell with its gimbal angles, a column for each sensor axis (deg/h, ug), each bias tested alone; "."
// where it lies within three of its sigmas. `data` must be what `diagnosis` is of.
std::string dwell_table(const ImuData& data, const diagnosis::Diagnosis& diagnosis);

}  // namespace selfcal::cli
