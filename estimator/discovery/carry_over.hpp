// Which equation of a class to report, and how probable it is that it holds on a plan that was never used.
//
// Equations that one recording cannot tell apart can be far from each other on another one. Each in turn is taken for the
// truth, with its probability: an equation a leaves of it |c_a z_a - c_b z_b|^2 / |c_b z_b|^2 on a plan of other positions
// with the vehicle in another attitude, z the whitened signatures there. Two such plans are asked: a walk over all multiples of
// 45 degrees, and one that stands at the odd ones only, where what differs at right angles may be a constant.
#pragma once

#include <Eigen/Core>
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
  Eigen::MatrixXd information;      // [laws x laws] of the coefficients, on both plans together
  Eigen::MatrixXd here;             // the same on the first of them with the vehicle as it stands
};

// Whether the two are one function in other words: fitted in each other's place they leave less than 1 sigma and less than a
// hundredth of the power, on all plans that `elsewhere` was asked on.
bool one_function(const CarryOver& elsewhere, const std::vector<PossibleLaw>& laws, std::size_t a, std::size_t b);
// The same with the vehicle as it stands. On a level base sin(outer) and a component of gravity are one function whatever the
// gimbal does.
bool one_function_here(const CarryOver& elsewhere, const std::vector<PossibleLaw>& laws, std::size_t a, std::size_t b);

// `like`: the unit, its noise and its site. Laws of temperature carry over to themselves only.
CarryOver carry_over(const UnitRecording& like, const std::vector<PossibleLaw>& laws, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
