// Runs the estimator off the event loop: one thread, a stop token, and an eventfd that brings progress and the
// answer back onto the loop.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "daemon/estimate/running_estimate.hpp"
#include "daemon/host/event_loop.hpp"
#include "estimator/passes/calibration.hpp"
#include "protocol/error.hpp"

namespace selfcal {

// What the estimator's thread hands back.
struct Estimate {
  CalibrationResult result;
  std::vector<std::string> objections;  // of the gate, empty: acceptable
  std::vector<std::string> warnings;    // of the recording
  std::vector<std::string> notes;       // for the story of the run
  std::string result_json;
  std::string recording;  // path
};

using EstimateProgress = std::function<void(const CalibrationProgress&)>;
using EstimateJob = std::function<Expected<Estimate>(const EstimateProgress&, std::stop_token)>;

// The calibration's view of it, so that tests can answer at once.
class Estimators {
 public:
  virtual ~Estimators() = default;
  // Callbacks come on the loop. One job at a time, of either kind; starting another, or cancel(), stops the one
  // before, whose answer is then dropped.
  virtual void start(EstimateJob job, EstimateProgress on_progress,
                     std::function<void(Expected<Estimate>)> on_done) = 0;
  // While data still come: at a lower priority than what brings them.
  virtual void start_running(RunningJob job, RunningDone on_done) = 0;
  virtual void cancel() = 0;
};

class EstimateWorker : public Estimators {
 public:
  explicit EstimateWorker(EventLoop& loop);
  ~EstimateWorker() override;

  void start(EstimateJob job, EstimateProgress on_progress, std::function<void(Expected<Estimate>)> on_done) override;
  void start_running(RunningJob job, RunningDone on_done) override;
  void cancel() override;

 private:
  using Delivery = std::function<void()>;  // to be called on the loop
  // Shared with the thread, which may outlive the interest in its answer.
  struct Mailbox {
    std::mutex mutex;
    Delivery progress;  // the latest
    Delivery answer;
    int wake_fd = -1;
    ~Mailbox();
    void put(Delivery Mailbox::*slot, Delivery delivery);
  };
  void launch(std::function<void(Mailbox&, std::stop_token)> work);
  void collect();

  EventLoop& loop_;
  std::shared_ptr<Mailbox> mailbox_;
  std::unique_ptr<EventLoop::Io> wake_;
  std::jthread thread_;
};

}  // namespace selfcal
