// A recording without the laws that were told of it: what it still shows against the 24.
#pragma once

#include <span>
#include <stop_token>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {

// Increments of the recording less all laws of the fit. `recording.data` must outlive it.
diagnosis::CorrectedRecording less_laws(const UnitRecording& recording, const LawFit& fit);

// The fit of the laws that are told, without what is only described: where nothing is, `found.fit`.
LawFit fit_of_told(std::span<const UnitRecording> recordings, const Discovery& found, const std::stop_token& stop = {});

// Innovations and places of that recording, about the calibration of the whole one: the 33 states follow. Two filter passes.
Left left_by_laws(const UnitRecording& recording, const LawFit& fit, bool coloured);

}  // namespace selfcal::discovery
