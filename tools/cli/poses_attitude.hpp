// The attitude that `selfcal poses` holds a log against: columns of the log itself, or of a file of its own.
#pragma once

#include <optional>
#include <string>

#include "protocol/error.hpp"
#include "tools/cli/poses_input.hpp"

namespace selfcal::cli {

struct AttitudeChoice {
  std::string file;  // empty: the log, if a name of its columns says that something else measured an attitude
  std::string
      columns;  // numbers from 1 or names, commas between; 4 are a quaternion, 3 roll, pitch and yaw, 9 a matrix; empty: by their names
};

struct ChosenAttitude {
  std::optional<diagnosis::ReferenceAttitude> attitude;
  std::string notes;  // what was taken for what, and what was not; empty: nothing to say
};

// Errors (bad_input): no such columns, none that is an attitude, a row that is none, by file and row; times that do not increase.
Expected<ChosenAttitude> choose_attitude(const std::string& log_path, const RawLog& log, const AttitudeChoice& choice);

}  // namespace selfcal::cli
