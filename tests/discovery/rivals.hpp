// What else one could do with the same recording, for comparison: no filter's projection, no probabilities before the data.
//
// Both start from the bias that each piece of the recording seems to show by itself on each axis, score over information, as if
// nothing else were fitted.
#pragma once

#include <string>
#include <vector>

#include "estimator/discovery/pieces.hpp"

namespace selfcal::discovery_trial {

struct RivalLaw {
  int axis = 0;
  std::string expression;
  double coefficient = 0.0;  // in unit_of(axis)
};

// Functions of the search's own dictionary taken one after the other while Schwarz's criterion falls.
std::vector<RivalLaw> stepwise(const discovery::PieceSums& sums, const laws::VariableSet& available);
// A Gaussian process over force, rate, angles, senses and time for each axis, length and variance by maximum likelihood, written
// as a sum of bells about ten inducing points. Axes where it does not beat noise by Schwarz's criterion stay as they are.
std::vector<RivalLaw> gaussian_process(const discovery::PieceSums& sums, const laws::VariableSet& available);

}  // namespace selfcal::discovery_trial
