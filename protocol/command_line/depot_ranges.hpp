// Ranges of the options of a depot's commands (the others': ranges.hpp).
#pragma once

#include "protocol/command_line/ranges.hpp"

namespace selfcal::range {

inline constexpr Range look_ahead{0.0, 36500.0, "days"};
inline constexpr Range parameter_limit{1e-12, 1e12, ""};
inline constexpr Range risk{1e-6, 0.5, ""};
inline constexpr Range calibration_interval{0.1, 20.0, "years"};

// Batches.
inline constexpr WholeRange jobs{1, 1024};
inline constexpr WholeRange tasks_a_job{1, 100'000};
inline constexpr WholeRange tries{1, 100};
inline constexpr WholeRange try_limit{1, 1'000'000};
inline constexpr WholeRange cases{1, 100'000};
inline constexpr WholeRange part{0, 1'000'000};

}  // namespace selfcal::range
