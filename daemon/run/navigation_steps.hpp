// The INS's navigation check: the free-inertial drift before and after, and the end of a check that is under way.
#pragma once

#include "daemon/run/run_steps.hpp"

namespace selfcal {

class NavigationSteps : public RunSteps {
 public:
  explicit NavigationSteps(const StepContext& context) : RunSteps(context) {}

  Task<Step> measure_drift(double RunRecord::*figure);
  Task<Step> end_check();
  // Also one that another tester began; without one nothing is done.
  Task<Answer<Done>> stop_check();
};

}  // namespace selfcal
