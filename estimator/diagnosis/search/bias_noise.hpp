// Biases that change with time, as states of the filter: columns of dwells find them, but do not hold what goes on inside a dwell.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/search/steps.hpp"

namespace selfcal::diagnosis {

// The parameter among the 24 that is the bias of an axis, gyros first.
int bias_of(int axis);

// Axes and triads that no process of the hypothesis takes.
std::vector<std::vector<int>> open_axes(const Hypothesis& hypothesis);

// `noise` with these as states, and no others.
NoiseModel with_processes(NoiseModel noise, const std::vector<BiasProcess>& processes);

// The stage with one of `found` as states besides, that which the filter likes best, as a walk or as an instability: a walk unless the
// other is more likely by 20:1. Sizes and times are those of the greatest likelihood. None where the filter does not find what the
// columns showed, to this significance.
std::optional<Stage> with_process(const SearchGround& ground, const Stage& stage, const std::vector<BiasProcess>& found,
                                  const Significance& significance);

// Of either triad the process that gains most as states of the filter besides: of one axis or of all, roughly fitted. A coarse quantum's noise hides
// from the columns of whole dwells what the filter sees inside them.
std::vector<BiasProcess> best_in_filter(const SearchGround& ground, const Stage& stage);

// Beside white noise of the accelerometers' integral, which hides from the columns of whole dwells what the filter sees inside them: where
// something remains in dwells, rotations or times (1 %), with the process that explains most of it, if by chance one would in 1 %; where it is one
// place that barely remains (10^-5 and more), in 20 %, if it leaves nothing: a sensor's slow noise is not of one strength throughout. That
// something is there is not asked again: only what.
std::optional<Stage> explain_remainder(const SearchGround& ground, const Stage& stage);

// Twice the log-likelihood that process i of the stage's hypothesis gains beside all else.
double gain_of_process(const SearchGround& ground, const Stage& stage, std::size_t i);
// Without process i.
Stage without_process(const SearchGround& ground, const Stage& stage, std::size_t i);
// With every process fitted once more beside what is named now. None: there is none.
std::optional<Stage> refit_processes(const SearchGround& ground, const Stage& stage);

// What it does to the 24 that a walk may be an instability and the other way round: a walk is zero when the recording begins, and
// an instability has the mean zero, so that the constant biases beside them are not the same. To be added to estimate and covariance.
struct KindAverage {
  ParameterVector shift = ParameterVector::Zero();
  ParameterMatrix covariance = ParameterMatrix::Zero();
};
KindAverage average_kinds(const Stage& stage);

}  // namespace selfcal::diagnosis
