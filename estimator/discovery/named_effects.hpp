// The recording without the effects that a diagnosis named: what discovery is to look at beside them.
#pragma once

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

// Increments less what the named effects put out; those of the recording where nothing was named. Motions of the base and
// noise stay: they are in the calibration.
Increments without_named(const ImuData& data, const diagnosis::Diagnosis& diagnosis);

}  // namespace selfcal::discovery
