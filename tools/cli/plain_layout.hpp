// Which columns of a log without names hold what `selfcal poses` reads.
#pragma once

#include <string>

#include "tools/cli/poses_layout.hpp"

namespace selfcal::cli {

// Time, three gyros, three accelerometers, or one triad, or one gyro; beside six one more column; with a rate the time may lack. Which triad is
// which, and where the seventh column stands, the numbers tell; six of which they do not tell stand in that order. `named`: what is called a
// temperature is no sensor. Errors (bad_input): too few columns, too many; seven of which the numbers do not tell.
Expected<PoseLayout> plain_layout(const import::ColumnSource& source, const std::vector<import::NamedColumn>& named,
                                  diagnosis::Sensors sensors, const RawColumns& columns, const std::string& file);

}  // namespace selfcal::cli
