// Which equation of a class to report, and how probable it is that it holds on a plan that was never used.
//
// Equations that one recording cannot tell apart can be far from each other on another one. Each in turn is taken for the
// truth, with its probability: an equation a leaves of it |c_a z_a - c_b z_b|^2 / |c_b z_b|^2 on a plan of other positions
// with the vehicle in another attitude, z the whitened signatures there.
#pragma once

#include <stop_token>
#include <vector>

#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {

struct PossibleLaw {
  LawTerm term;
  double coefficient = 0.0;  // in unit_of(axis)
  double odds = 0.0;         // against any reference, the same for all
};

struct CarryOver {
  std::vector<double> probability;  // [laws] that at most a tenth of the misfit's power is left on another plan
  std::vector<double> merit;        // [laws] the same with a soft limit: what is compared
};

// `like`: the unit, its noise and its site. Laws of temperature carry over to themselves only.
CarryOver carry_over(const UnitRecording& like, const std::vector<PossibleLaw>& laws, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
