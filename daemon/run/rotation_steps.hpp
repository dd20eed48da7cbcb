// The schedule, the rotation and its last page.
#pragma once

#include "daemon/run/raw_data.hpp"
#include "daemon/run/run_steps.hpp"
#include "daemon/run/running_steps.hpp"

namespace selfcal {

class RotationSteps : public RunSteps {
 public:
  RotationSteps(const StepContext& context, RawData& raw, RunningSteps& running)
      : RunSteps(context), raw_(raw), running_(running) {}

  Task<Step> write_schedule();
  Task<Step> start_rotation();
  Task<Step> follow_rotation();
  Task<Step> end_rotation_early();
  Task<Step> pull_last_pages();
  Task<Step> stop_gimbal();

 private:
  Task<Answer<Done>> poll_state();
  Task<Answer<Done>> bring_to_rest();

  RawData& raw_;
  RunningSteps& running_;
};

}  // namespace selfcal
