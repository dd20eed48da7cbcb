// Effects that a recording cannot tell apart, and the experiment that would.
//
// With Z the columns of a pass (signature_pass.hpp) and the effect A of size a as found, a rival B fitted in its place
// leaves a misfit of a^T (G_AA - G_AB G_BB^-1 G_BA) a, G = Z^T Z: the square of the separation in sigma. A further
// recording adds its own G, for it needs no data.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/geometry/schedule.hpp"

namespace selfcal::diagnosis {

struct Experiment {
  std::string id;  // longer, slow_turns, dwells_45, tilted_base, second_heading
  std::string words;
  Schedule schedule;
  double separation = 0.0;  // sigma, from the closest rival, with the present recording and this one
  std::string closest;      // that rival
};

struct Split {
  std::string effect;
  std::vector<std::string> rivals;
  double separation_now = 0.0;
  std::vector<Experiment> experiments;  // best first
  // Rivals that hold the effect as a special case: nothing splits them, the fewer parameters are preferred.
  std::vector<std::string> contain;
};

// One entry per finding that has equivalents. `done`: the schedule of the recording, which the experiments vary.
std::vector<Split> plan_splits(const Diagnosis& diagnosis, const ImuData& data, const Schedule& done);

}  // namespace selfcal::diagnosis
