#include "daemon/run/running_estimates.hpp"

namespace selfcal {
namespace {

// An estimate may take this part of one processor at most, whatever the pace of the data.
constexpr double pause_per_work = 4.0;

}  // namespace

void RunningEstimates::pages_arrived(std::uint32_t pages, double page_s, const Make& make, Tell tell) {
  const double data_s = pages * page_s;
  const bool due = data_s >= least_running_data_s && data_s >= begun_s_ + interval_s_;
  if (interval_s_ <= 0 || busy_ || !due || timers_.now() < not_before_) {
    return;
  }
  if (!estimator_) {
    estimator_ = make();
  }
  busy_ = true;
  begun_s_ = data_s;
  estimators_.start_running(running_job(estimator_, pages),
                            [this, tell = std::move(tell)](const Expected<RunningEstimate>& answer, double cpu_s) {
                              take(answer, cpu_s, tell);
                            });
}

void RunningEstimates::take(const Expected<RunningEstimate>& answer, double cpu_s, const Tell& tell) {
  busy_ = false;
  not_before_ = timers_.now() + std::chrono::nanoseconds(static_cast<std::int64_t>(pause_per_work * cpu_s * 1e9));
  const bool first_met = answer && answer->met && !(latest_ && latest_->met);
  if (answer) {
    latest_ = *answer;
  }
  tell(answer, begun_s_, first_met);
}

void RunningEstimates::drop_current() { busy_ = false; }

void RunningEstimates::end() { estimator_.reset(); }

}  // namespace selfcal
