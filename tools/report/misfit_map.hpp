// Where recording and model differ, for the eye: a bias of one sensor axis in one position, so long after the turn.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::report {

// {"edges_s": [...], "cells": {"position": [...], "axis": [...], "bin": [...], "middle_s": [...], "bias": [...],
// "sigma": [...], "signature": [...]}, "dwells": {"position", "axis", "bias", "sigma", "signature"}}: "dwells" is of each
// whole dwell, "cells" of stretches of it: bin -1 is the turn that leads to the position, 0.. lie between the edges after
// it. "bias" is what the recording shows against the 24 alone, each cell tested on its own, "signature" what the named
// equations, and the laws that were found beside them, make of the same cell; both in deg/h (axes 0 to 2) or ug (3 to 5), with the
// same sigma. Linear about the answer of the 24 alone (signature_pass.hpp). `data` must be what `diagnosis` is of, `without_laws` the
// same recording less the laws; null: none was found.
nlohmann::ordered_json misfit_map(const ImuData& data, const diagnosis::Diagnosis& diagnosis,
                                  const ImuData* without_laws);

}  // namespace selfcal::report
