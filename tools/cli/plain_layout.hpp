// Which columns of a log without names hold what `selfcal poses` reads.
#pragma once

#include <string>

#include "tools/cli/poses_layout.hpp"

namespace selfcal::cli {

// Time, three gyros, three accelerometers, or one triad, or one gyro. With a rate the time may lack. Errors (bad_input): too few columns, too many.
Expected<PoseLayout> plain_layout(const import::ColumnSource& source, diagnosis::Sensors sensors,
                                  const RawColumns& columns, const std::string& file);

}  // namespace selfcal::cli
