// When an estimate of the data so far is begun, and what the latest one said. What it shows the operator is the run's
// affair (running_steps.cpp).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/host/timers.hpp"

namespace selfcal {

class RunningEstimates {
 public:
  // `interval_s`: of data, from one estimate to the next; 0: none is made.
  RunningEstimates(Timers& timers, Estimators& estimators, double interval_s)
      : timers_(timers), estimators_(estimators), interval_s_(interval_s) {}

  // So many pages have arrived without a gap. Begins an estimate where one is due; `make` gives the estimator for the first.
  using Make = std::function<std::shared_ptr<RunningEstimator>()>;
  // `first_met`: every tolerance is met, and was not before. An error: no estimate yet, after `data_s` of data.
  using Tell = std::function<void(const Expected<RunningEstimate>& answer, double data_s, bool first_met)>;
  void pages_arrived(std::uint32_t pages, double page_s, const Make& make, Tell tell);

  void drop_current();  // what still runs is of no use
  void end();           // nor is what was kept for the next one
  const std::optional<RunningEstimate>& latest() const { return latest_; }

 private:
  void take(const Expected<RunningEstimate>& answer, double cpu_s, const Tell& tell);

  Timers& timers_;
  Estimators& estimators_;
  double interval_s_;
  std::shared_ptr<RunningEstimator> estimator_;
  std::optional<RunningEstimate> latest_;
  bool busy_ = false;
  double begun_s_ = 0.0;  // of data, when the last one was begun
  SteadyTime not_before_{};
};

}  // namespace selfcal
