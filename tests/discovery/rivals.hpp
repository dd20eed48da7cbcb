// What else one could do with the same recording, for comparison: functions fitted to what the calibration leaves, the 33 states
// held where it put them instead of projected out, no probabilities before the data, no held-out proof.
#pragma once

#include <string>
#include <vector>

#include "estimator/discovery/law_motion.hpp"
#include "estimator/discovery/pieces.hpp"

namespace selfcal::discovery_trial {

struct RivalLaw {
  int axis = 0;
  std::string expression;
  double coefficient = 0.0;  // in unit_of(axis)
};

// What a bias of each axis in each piece does where the states are known.
discovery::PieceSums with_states_held(const discovery::LawMotion& motion, PassInput input);

// Functions of the search's own dictionary taken one after the other while Schwarz's criterion falls.
std::vector<RivalLaw> stepwise(const discovery::PieceSums& sums, const laws::VariableSet& available);
// A Gaussian process over force, rate, angles, senses and time for each axis, length and variance by maximum likelihood, written
// as a sum of bells about ten inducing points. Axes where it does not beat noise by Schwarz's criterion stay as they are.
std::vector<RivalLaw> gaussian_process(const discovery::PieceSums& sums, const laws::VariableSet& available);

}  // namespace selfcal::discovery_trial
