// Ranges of the options of a depot's commands (the others': ranges.hpp).
#pragma once

#include "protocol/command_line/ranges.hpp"

namespace selfcal::range {

inline constexpr Range look_ahead{0.0, 36500.0, "days"};
inline constexpr Range parameter_limit{1e-12, 1e12, ""};
inline constexpr Range risk{1e-6, 0.5, ""};
inline constexpr Range calibration_interval{0.1, 20.0, "years"};

}  // namespace selfcal::range
