// The estimate that runs along with the rotation, and whether the rotation may end early by it.
#pragma once

#include "daemon/run/raw_data.hpp"
#include "daemon/run/run_steps.hpp"
#include "daemon/run/running_estimates.hpp"

namespace selfcal {

class RunningSteps : public RunSteps {
 public:
  RunningSteps(const StepContext& context, Estimators& estimators, RawData& raw);

  void estimate_meanwhile();  // begins an estimate where one is due
  void foresee_finish();      // when the rotation ends, by its schedule or before
  // By the estimate and the status frames; confirm_standing() asks the INS itself.
  bool may_end_early() const;
  Task<Answer<bool>> confirm_standing();
  void note_early_end();
  void drop_current() { running_.drop_current(); }
  void end() { running_.end(); }

 private:
  void on_running_estimate(const Expected<RunningEstimate>& answer, double data_s, bool first_met);

  RawData& raw_;
  RunningEstimates running_;
  bool out_of_reach_said_ = false;
  bool contradiction_said_ = false;  // of status frames and answers
};

}  // namespace selfcal
