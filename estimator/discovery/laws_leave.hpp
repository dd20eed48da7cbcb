// A recording without the laws and processes that were told of it: what it still shows against the 24, and what the 24 are.
#pragma once

#include <span>
#include <stop_token>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal::discovery {

// Increments of the recording less all laws of the fit, and less what they move the effects by whose coefficients are unknown beside it. `recording.data` must outlive it.
diagnosis::CorrectedRecording less_laws(const UnitRecording& recording, const LawFit& fit);

// The fit of the laws that are told, without what is only described: where nothing is, `found.fit`.
LawFit fit_of_told(std::span<const UnitRecording> recordings, const Discovery& found, const std::stop_token& stop = {});

// Innovations and places of that recording, about the calibration of the whole one: the 33 states follow, and what the processes do.
// Two filter passes.
Left left_by(const UnitRecording& recording, const LawFit& fit, std::span<const DiscoveredProcess> processes,
             bool coloured);

// The 24 of each recording by itself with the processes in the filter and coefficients and constants of the laws free: sigma holds what
// a new offset at each turn does to them. Two passes for each recording.
ClassAverage beside_processes(std::span<const UnitRecording> recordings, const LawFit& fit,
                              std::span<const DiscoveredProcess> processes, const std::stop_token& stop = {});

}  // namespace selfcal::discovery
