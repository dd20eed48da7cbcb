// How far a law's coefficient and constant may be from the values that are told, where a law is not linear in its constant.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <stop_token>

#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

// Root mean square distances from the values that are told, over all values of the constant.
struct ConstantSpread {
  double coefficient = 0.0;  // in unit_of(axis)
  double constant = 0.0;
};

// `fits` of the term with its constant at `values`, which are evenly spaced on a logarithmic scale.
ConstantSpread spread_about(double coefficient, double constant, std::span<const SingleFit> fits,
                            std::span<const double> values);

// Of term k, whose only constant is taken for equally probable on a logarithmic scale before the data. A creep of 10 sigma knows
// its time constant to a third: the coefficient then follows it along a curve, and the tangent of Gauss-Newton is too short.
// The other terms are fitted anew at each value. Empty where the term has no constant, or more than one.
std::optional<ConstantSpread> spread_over_constant(std::span<const LawRecording> recordings, const LawFit& fit,
                                                   std::size_t k, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
