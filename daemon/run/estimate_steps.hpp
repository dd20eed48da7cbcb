// From the pages to the set that is to be written: the estimate, the gate's objections, the new set. These steps need no INS.
#pragma once

#include <functional>
#include <vector>

#include "daemon/estimate/amendment_job.hpp"
#include "daemon/run/run_steps.hpp"
#include "daemon/run/running_steps.hpp"

namespace selfcal {

class EstimateSteps : public RunSteps {
 public:
  // `post` gets the event that follows, from the loop or at once.
  EstimateSteps(const StepContext& context, Estimators& estimators, RunningSteps& running,
                std::function<void(Event)> post)
      : RunSteps(context), estimators_(estimators), running_(running), post_(std::move(post)) {}

  void estimate();
  void judge();

 private:
  KeptRecording kept_recording(RunId run) const;
  std::vector<KeptRecording> further_recordings() const;
  void on_estimate_progress(const CalibrationProgress& progress);
  void on_estimate(Expected<Estimate> answer);
  Expected<void> store_result();
  Expected<void> make_new_set();

  Estimators& estimators_;
  RunningSteps& running_;
  std::function<void(Event)> post_;
};

}  // namespace selfcal
