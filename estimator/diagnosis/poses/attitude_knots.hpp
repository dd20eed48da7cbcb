// Samples of an attitude as stamps with a value each. Private to this folder.
//
// In rows of a faster log a value is held until the next one comes: its stamp is the row in which it changes, and where those rows are what a
// clock of equal intervals makes of the log's rows, that clock's.
#pragma once

#include <vector>

#include "estimator/diagnosis/poses/attitude.hpp"

namespace selfcal::diagnosis {

struct Knot {
  double time_s = 0.0;
  std::size_t sample = 0;
  bool begins = false;  // nothing is known between it and the one before
  bool held = false;    // the value stood still since the one before: at rest, or lost
};

struct Knots {
  std::vector<Knot> all;
  double interval_s = 0.0;   // usual one
  std::size_t without = 0;   // samples that are no attitude
  std::size_t left_out = 0;  // single ones that stand apart from those before and behind them
};

Knots find_knots(const ReferenceAttitude& attitude);

}  // namespace selfcal::diagnosis
