// How long a run may stay in a state of the table without progress. What counts as progress is the engine's to say
// (calibration_run.hpp): a state that the run had not come to before, a page more, a step of the estimator. That the INS is
// alive is none: response-pending, flow control, answers to other requests, a page that came before.
#pragma once

#include "daemon/host/config.hpp"
#include "daemon/run/transition_table.hpp"

namespace selfcal {

// Seconds on the operator's clock. `page_s`: seconds of data in a page, on the INS's clock; 0 while it is not known.
double budget_s(State state, const InsConfig& config, double page_s);

}  // namespace selfcal
