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
  double separation = 0.0;          // sigma, from the closest rival, with the present recording and this one
  const Effect* closest = nullptr;  // that rival
};

struct Split {
  const Effect* effect = nullptr;
  std::vector<const Effect*> rivals;
  double separation_now = 0.0;
  std::vector<Experiment> experiments;  // best first
  // Rivals that hold the effect as a special case: nothing splits them, the fewer parameters are preferred.
  std::vector<const Effect*> contain;
};

// How far a rival, at its best constant, stays from the effect.
struct Separation {
  double square = 0.0;  // sigma^2
  double share = 0.0;   // of the effect's own square
  const Effect* closest = nullptr;
};
// `columns`: the effect, which has `size`, and every variant of its rivals, with their columns in G = Z^T Z.
std::vector<Separation> separations(const Eigen::MatrixXd& G, const std::vector<Candidate>& columns,
                                    const Eigen::VectorXd& size);

// One entry per finding that has equivalents. `done`: the schedule of the recording, which the experiments vary.
std::vector<Split> plan_splits(const Diagnosis& diagnosis, const ImuData& data, const Schedule& done);

}  // namespace selfcal::diagnosis
