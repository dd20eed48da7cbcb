// The estimate while the gimbal still turns: the same calibration of what has arrived so far, and what the rest of the
// schedule will add to it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "daemon/store/page_recording.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal {

// The rotation is ended early only when every sigma is below this fraction of its tolerance: the noise is estimated
// again from all data at the end, and a sigma that grows by a twentieth must not shut the gate.
inline constexpr double early_end_margin = 0.95;
// Less data than this gives no alignment.
inline constexpr double least_running_data_s = 90.0;

struct Forecast {
  double met_at_s = -1.0;                 // into the schedule, when every tolerance will be met; -1: not within it
  std::vector<std::string> out_of_reach;  // parameters that stay above their tolerance at the schedule's end
};

struct RunningEstimate {
  double data_s = 0.0;                  // it is made of so much
  ParameterVector value, sigma;         // SI
  ParameterVector tolerance;            // SI
  std::vector<std::string> objections;  // of the gate, were the data to end here
  bool met = false;                     // no objection, and every sigma below the tolerance by the margin
  Forecast forecast;
};

using RunningJob = std::function<Expected<RunningEstimate>(std::stop_token)>;
// The answer and the processor time that it took, s.
using RunningDone = std::function<void(Expected<RunningEstimate>, double)>;

// What the rest of `schedule` gives after `data_s` of it: covariance analysis with attitude and noise as found so far.
// Where the data so far gave less than the analysis predicts (a moving base), the rest is assumed to give less by as much.
Forecast forecast(const Schedule& schedule, const CalibrationResult& so_far, const earth::Position& site, double data_s,
                  const ParameterVector& tolerance);

// The pages taken up so far; shared by the jobs of one rotation, which run one after the other.
class RunningEstimator {
 public:
  explicit RunningEstimator(EstimateRequest request) : request_(std::move(request)) {}

  // Of the pages below `pages`. Fails where there is no answer (yet): too little data to align.
  Expected<RunningEstimate> estimate(std::uint32_t pages, const std::stop_token& stop);

 private:
  EstimateRequest request_;
  std::optional<PageRecording> recording_;
};

RunningJob running_job(std::shared_ptr<RunningEstimator> estimator, std::uint32_t pages);

}  // namespace selfcal
