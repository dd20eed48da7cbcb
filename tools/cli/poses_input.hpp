// What the diagnosis by poses reads.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/poses.hpp"
#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"
#include "tools/cli/poses_layout.hpp"

namespace selfcal::cli {

// Whether its read-outs are not 0 throughout: such stand for none.
bool has_read_outs(const Recording& recording);
// Increments to rates, rad/s and m/s^2; read-outs where it has any; the first temperature channel.
diagnosis::PoseInput pose_input_of(const Recording& recording);
// Gravity of the place, and how far it is known: height 0 where none is given, anywhere on the Earth without a latitude.
void set_place(std::optional<double> latitude_deg, std::optional<double> height_m, diagnosis::PoseInput& input);
// What `selfcal poses` is asked of logs.
struct RawFiles {
  std::vector<std::string> poses;  // one log; or one after the other, between which nothing is known
  std::string gyros;               // of the first one's gyros, where they have a file of their own; empty: in it
  std::optional<double> latitude_deg, height_m;
};
struct RawLog {
  diagnosis::PoseInput input;
  bool si = false;             // rad/s and m/s^2
  long double begin_s = 0.0L;  // of a time of the calendar: what was taken off
  bool nameless = false;       // no names, both triads in the order of the handbook
  std::string notes;           // what was taken for what, where no order of the handbook says it; empty: nothing to say
};
// Logs as columns, whatever their form (protocol/import/column_source.hpp), by their names or in the order of the handbook (poses_layout.hpp). What
// units the names say is taken to SI; everything else is raw. Errors (bad_input): no such columns; a line without a number, a time that does not
// increase, by line or row.
Expected<RawLog> read_raw_poses(const RawFiles& files, const RawColumns& columns);

}  // namespace selfcal::cli
