// Waves over the time that keep step with the turns. Where all dwells are equally long whatever comes with each turn makes one: a creep of
// a form that is not known, a change within each dwell. On a schedule of other dwells the wave says something else.
#pragma once

#include <span>

#include "estimator/diagnosis/regression/recording_context.hpp"
#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

// Whether turns follow each other evenly and this period, or two or three of it, goes from one to the next: by less than half a
// period over all of them, which is what they resolve.
bool in_step(std::span<const diagnosis::Turn> turns, double period_s);

// Whether a law is such a wave, alone or times something, on all of the recordings.
bool in_step_with_turns(std::span<const LawRecording> recordings, const LawTerm& law);

}  // namespace selfcal::discovery
