// Channels beside the sensors that are wrong for a while: read-outs of the gimbal and temperature, of which single samples jump and come back, and
// a read-out that holds its value while the gyros turn. Effects and laws are functions of them: ten samples of 0 degC made a
// bias that follows temperature a law that no catalogue holds, a read-out that held made the accelerometers contradict the gyros.
#pragma once

#include <vector>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/models/imu_data.hpp"

namespace selfcal::diagnosis {

struct MendedSideChannels {
  // As long as the recording; empty where nothing is wrong with any. Samples that jump lie between their neighbours; through a hold the angles
  // are those before it, turned by the gyros, to where they are behind it.
  std::vector<double> outer, inner;  // rad
  std::vector<double> temperature;   // degC
  std::vector<DataFault> faults;  // read_out, temperature; with stretches of the recording, in which no sensor is wrong
};

// Not read-outs that are wrong all along (axes.hpp), nor those that are in degrees.
MendedSideChannels mend_side_channels(const ImuData& data);

}  // namespace selfcal::diagnosis
