// Status on LCM, best effort: without a route nothing is published; that is logged once, and publishing is tried again.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "daemon/host/timers.hpp"
#include "daemon/run/calibration_run.hpp"

namespace lcm {
class LCM;
}

namespace selfcal {

// One INS as the publisher shows it; `run` null: none yet.
struct PublishedIns {
  std::string name;
  std::string serial;
  const RunProgress* progress = nullptr;
  bool active = false;
  bool state_idle = true;
};

class LcmPublisher {
 public:
  LcmPublisher(Timers& timers, std::string url);  // empty url: publishes nothing
  ~LcmPublisher();

  void publish_service(int instruments, int runs_in_progress);
  void publish_ins(const PublishedIns& ins);
  void publish_estimate(const PublishedIns& ins);
  void publish_alarm(const std::string& ins, RunId run, bool standing, const std::string& text);

 private:
  template <typename Message>
  void publish(const std::string& channel, const Message& message);
  void open();

  Timers& timers_;
  std::string url_;
  std::unique_ptr<lcm::LCM> lcm_;
  SteadyTime started_;
  SteadyTime tried_at_{};
  bool tried_ = false;
  bool down_said_ = false;
};

}  // namespace selfcal
