// Spectra and Allan deviations of the six sensors, overlaid. Private to this folder.
#pragma once

#include "tools/report/overlay.hpp"

namespace selfcal::report {

// Periodograms of equal pieces of the dwells (Hann, mean and slope taken out), averaged over pieces and over neighbouring bins.
std::vector<OverlayCurve> overlay_spectra(const ImuData& recording, const ImuData& simulation);
// Overlapping Allan deviation at octaves; degrees of freedom by the noise that rules at each (NIST SP 1065, table 5).
std::vector<OverlayCurve> overlay_allan(const ImuData& recording, const ImuData& simulation);

}  // namespace selfcal::report
