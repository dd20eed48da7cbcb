// Time and timers, as the calibration sees them: the event loop's in the daemon, simulated ones in tests.
#pragma once

#include <chrono>
#include <coroutine>
#include <cstdint>
#include <functional>

namespace selfcal {

using SteadyTime = std::chrono::nanoseconds;  // since an arbitrary origin, never set back

class Timers {
 public:
  using Id = std::uint64_t;  // 0: none
  virtual ~Timers() = default;

  virtual SteadyTime now() const = 0;
  virtual Id after(std::chrono::nanoseconds delay, std::function<void()> callback) = 0;
  virtual void cancel(Id id) = 0;  // of a timer that has fired or never was: no effect
};

// co_await Sleep(timers, 100ms). Breaking off the waiting task cancels the timer.
class Sleep {
 public:
  Sleep(Timers& timers, std::chrono::nanoseconds delay) : timers_(timers), delay_(delay) {}
  Sleep(const Sleep&) = delete;
  Sleep& operator=(const Sleep&) = delete;
  ~Sleep() { timers_.cancel(id_); }

  bool await_ready() const noexcept { return false; }
  void await_suspend(std::coroutine_handle<> waiting) {
    id_ = timers_.after(delay_, [this, waiting] {
      id_ = 0;
      waiting.resume();
    });
  }
  void await_resume() const noexcept {}

 private:
  Timers& timers_;
  std::chrono::nanoseconds delay_;
  Timers::Id id_ = 0;
};

}  // namespace selfcal
