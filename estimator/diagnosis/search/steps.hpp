// The steps of the search. Each is a function from one stage to the next; none: there is no such step to take.
#pragma once

#include <optional>

#include "estimator/diagnosis/search/selection.hpp"
#include "estimator/diagnosis/search/stage.hpp"

namespace selfcal::diagnosis {

// What a step is taken on: the recording, and what a name must be worth there.
struct SearchGround {
  const RecordingContext& context;
  Significance significance;
};

// Of the recording, corrected as the stage has it, with the amplitudes of what is named fitted under this noise.
double log_likelihood(const SearchGround& ground, const Stage& stage, const NoiseModel& noise);

// With what explains most beside what is named: an equation, a random walk or an instability.
std::optional<Stage> add_best(const SearchGround& ground, const Stage& stage);
// Without the first term that is no longer significant given the others.
std::optional<Stage> drop_weak(const SearchGround& ground, const Stage& stage);
// With an alternative in the place of the first term that has a better one.
std::optional<Stage> exchange(const SearchGround& ground, const Stage& stage);
// Without the first process that is not significant where the forms stand beside it: a walk follows any slow curve, and may have
// been taken for what a form is.
std::optional<Stage> drop_weak_process(const SearchGround& ground, const Stage& stage);

// The calibration took part of what was left out for motion of the base. With the terms fitted its white noise is the one of
// the greatest likelihood, down to a micrometre, by factors of 3. None: it was.
std::optional<Stage> sharpen_observation(const SearchGround& ground, const Stage& stage);
// With the densities of a coarse quantum fitted once more, beside what is named (velocity_noise.hpp). None: they are at the top.
std::optional<Stage> refit_noise(const SearchGround& ground, const Stage& stage);

}  // namespace selfcal::diagnosis
