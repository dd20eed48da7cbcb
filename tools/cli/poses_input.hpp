// What the diagnosis by poses reads.
#pragma once

#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::cli {

// Increments to rates, rad/s and m/s^2; read-outs where they are not 0 throughout; the first temperature channel.
diagnosis::PoseInput pose_input_of(const Recording& recording);
// CSV: one header line, then time, three gyros, three accelerometers, or one triad of them alone, raw; further columns are ignored but
// for the angle of a table with one axis and a temperature.
struct RawColumns {
  diagnosis::Sensors sensors = diagnosis::Sensors::both;
  std::size_t angle = 0;        // its column, from 1, in deg; 0: none
  std::size_t temperature = 0;  // its column, from 1, in degC; 0: none
};
Expected<diagnosis::PoseInput> read_raw_poses(const std::string& path, const RawColumns& columns);

}  // namespace selfcal::cli
