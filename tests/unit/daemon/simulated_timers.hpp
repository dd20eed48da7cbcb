// Time that passes only when a test says so.
#pragma once

#include <map>

#include "daemon/host/timers.hpp"

namespace selfcal::testing_support {

class SimulatedTimers : public Timers {
 public:
  SteadyTime now() const override { return now_; }
  Id after(std::chrono::nanoseconds delay, std::function<void()> callback) override {
    const Id id = ++last_id_;
    queue_.emplace(std::pair{now_ + delay, id}, std::move(callback));
    return id;
  }
  void cancel(Id id) override {
    std::erase_if(queue_, [id](const auto& entry) { return entry.first.second == id; });
  }

  // Runs timers in their order until `done` or until nothing is left or `limit` has passed; true: done.
  bool run_until(const std::function<bool()>& done, std::chrono::nanoseconds limit) {
    const SteadyTime end = now_ + limit;
    while (!done()) {
      if (queue_.empty() || queue_.begin()->first.first > end) {
        return false;
      }
      auto node = queue_.extract(queue_.begin());
      now_ = node.key().first;
      node.mapped()();
    }
    return true;
  }

 private:
  SteadyTime now_{0};
  Id last_id_ = 0;
  std::map<std::pair<SteadyTime, Id>, std::function<void()>> queue_;
};

}  // namespace selfcal::testing_support
