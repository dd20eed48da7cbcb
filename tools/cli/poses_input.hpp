// What the diagnosis by poses reads.
#pragma once

#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::cli {

// Increments to rates, rad/s and m/s^2; read-outs where they are not 0 throughout.
diagnosis::PoseInput pose_input_of(const Recording& recording);
// CSV: one header line, then time, three gyros, three accelerometers, raw; further columns are ignored.
Expected<diagnosis::PoseInput> read_raw_poses(const std::string& path);

}  // namespace selfcal::cli
