// The one event loop of the daemon: sd-event behind a small C++ face. Everything but the estimator runs on it.
#pragma once

#include <systemd/sd-event.h>

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "daemon/host/timers.hpp"

namespace selfcal {

// An event source that ends with its owner.
struct SourceUnref {
  void operator()(sd_event_source* source) const { sd_event_source_disable_unref(source); }
};
using SourceHandle = std::unique_ptr<sd_event_source, SourceUnref>;

class EventLoop : public Timers {
 public:
  EventLoop();
  ~EventLoop() override;
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  SteadyTime now() const override;
  Id after(std::chrono::nanoseconds delay, std::function<void()> callback) override;
  void cancel(Id id) override;

  // Calls `ready(events)` whenever fd has EPOLL* `events`, until the handle is dropped. The fd stays the caller's.
  class Io {
   public:
    Io(EventLoop& loop, int fd, unsigned events, std::function<void(unsigned)> ready);
    Io(const Io&) = delete;
    Io& operator=(const Io&) = delete;
    void want(unsigned events);

   private:
    static int on_ready(sd_event_source* source, int fd, unsigned events, void* self);
    std::function<void(unsigned)> ready_;
    SourceHandle source_;
    unsigned events_;
  };

  // Signals are blocked in the whole process first (main does), then delivered here.
  void on_signal(int signal, std::function<void()> callback);
  // Runs before each wait of the loop.
  void before_wait(std::function<void()> callback);

  bool enable_watchdog();  // feeds systemd's watchdog from this loop, if the unit asks for one
  int run();
  void turn(std::chrono::microseconds longest);  // serves one event, if one comes in this time
  void stop(int exit_status);

 private:
  struct Timer {
    EventLoop* loop = nullptr;
    Id id = 0;
    std::function<void()> callback;
    SourceHandle source;
  };
  struct Callback {
    std::function<void()> call;
    SourceHandle source;
  };

  sd_event* event_ = nullptr;
  Id next_id_ = 1;
  std::map<Id, std::unique_ptr<Timer>> timers_;
  std::vector<std::unique_ptr<Callback>> callbacks_;
};

}  // namespace selfcal
