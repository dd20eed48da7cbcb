// Biases that change with time, as states of the filter: columns of dwells find them, but do not hold what goes on inside a dwell.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/search/steps.hpp"

namespace selfcal::diagnosis {

// `noise` with these as states, and no others.
NoiseModel with_processes(NoiseModel noise, const std::vector<BiasProcess>& processes);

// The stage with one of `found` as states besides, that which the filter likes best, as a walk or as an instability: a walk unless the
// other is more likely by 20:1. Sizes and times are those of the greatest likelihood. None where the filter does not find what the
// columns showed.
std::optional<Stage> with_process(const SearchGround& ground, const Stage& stage,
                                  const std::vector<BiasProcess>& found);

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
