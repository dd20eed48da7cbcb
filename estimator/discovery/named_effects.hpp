// The recording without the effects that a diagnosis named: what discovery is to look at beside them.
#pragma once

#include "estimator/diagnosis/corrected_recording.hpp"
#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::discovery {

// Less what the named effects put out; the recording itself, which must outlive it, where nothing was named. Motions of the base and
// noise stay: they are in the calibration.
diagnosis::CorrectedRecording without_named(const ImuData& data, const diagnosis::Diagnosis& diagnosis);

}  // namespace selfcal::discovery
