// The temperature that a log's column holds, in degC.
#pragma once

#include <string>
#include <vector>

#include "protocol/import/guess_names.hpp"

namespace selfcal::cli {

struct LogTemperature {
  std::vector<double> celsius;  // empty: not taken
  std::string notes;            // what was assumed, or why it was not taken
};

// In the unit that the name says (`named`), else in degC if the numbers may be that: a register's counts are no degrees. Of a log whose sensors
// are counts (`counts`), or called raw, a column of whole numbers is counts too. What the caller chose (`chosen`) is taken.
LogTemperature temperature_of(const std::vector<double>& values, const import::NamedColumn& named,
                              const std::string& title, bool chosen, bool counts);

}  // namespace selfcal::cli
