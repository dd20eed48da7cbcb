// What the diagnosis by poses reads.
#pragma once

#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal::cli {

// Whether its read-outs are not 0 throughout: such stand for none.
bool has_read_outs(const Recording& recording);
// Increments to rates, rad/s and m/s^2; read-outs where it has any; the first temperature channel.
diagnosis::PoseInput pose_input_of(const Recording& recording);
// A log as columns, whatever its form (protocol/import/column_source.hpp): those that their names call gyros and accelerometers, else time, three
// gyros, three accelerometers, or one triad of them alone, in this order. What units the names say is taken to SI; everything else is raw.
struct RawColumns {
  diagnosis::Sensors sensors = diagnosis::Sensors::both;
  std::size_t angle = 0;        // its column, from 1, in deg; 0: none
  std::size_t temperature = 0;  // its column, from 1, in degC; 0: none
  bool raw_gyros = false;       // the caller knows their unit: as they are
};
struct RawLog {
  diagnosis::PoseInput input;
  bool si = false;    // rad/s and m/s^2
  std::string notes;  // what was taken for what, where it is not the order above; empty: nothing to say
};
// Errors (bad_input): no such columns; a line without a number, a time that does not increase, by line or row.
Expected<RawLog> read_raw_poses(const std::string& path, const RawColumns& columns);

}  // namespace selfcal::cli
