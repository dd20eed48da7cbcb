// One calibration in simulated time: the daemon's CalibrationRun, the man in the middle, and the virtual INS behind its UDS
// server; and what must hold of it, whatever the man in the middle did.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/hostile/rule.hpp"

namespace selfcal::hostile {

struct Outcome {
  std::string state;                    // in which the run ended, or hangs
  std::string reason;                   // the operator's line
  double seconds = 0.0;                 // from begin to end, simulated
  std::uint64_t acted = 0;              // times that a rule did something
  std::vector<std::string> violations;  // of what must hold; empty: the case passed
};

// In a folder of its own, which is left empty. Deterministic but for seeds of SecurityAccess and the rotation's number.
Outcome play(const Case& one, const std::filesystem::path& folder);

}  // namespace selfcal::hostile
