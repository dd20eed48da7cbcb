#include "daemon/host/event_loop.hpp"

#include <fmt/format.h>
#include <time.h>

#include <cstring>
#include <stdexcept>

namespace selfcal {
namespace {

// The loop's own calls fail for want of memory or file descriptors only: the daemon cannot run then.
void require(int result, const char* what) {
  if (result < 0) {
    throw std::runtime_error(fmt::format("event loop: {}: {}", what, std::strerror(-result)));
  }
}

}  // namespace

EventLoop::EventLoop() { require(sd_event_new(&event_), "create"); }

EventLoop::~EventLoop() {
  timers_.clear();
  callbacks_.clear();
  sd_event_unref(event_);
}

SteadyTime EventLoop::now() const {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

Timers::Id EventLoop::after(std::chrono::nanoseconds delay, std::function<void()> callback) {
  auto timer = std::make_unique<Timer>();
  timer->loop = this;
  timer->id = next_id_++;
  timer->callback = std::move(callback);
  const auto at = std::chrono::duration_cast<std::chrono::microseconds>(now() + delay).count();
  sd_event_source* source = nullptr;
  require(sd_event_add_time(
              event_, &source, CLOCK_MONOTONIC, static_cast<std::uint64_t>(at), 1000,
              [](sd_event_source*, std::uint64_t, void* data) {
                auto* fired = static_cast<Timer*>(data);
                // Taken out first: the callback may set new timers, or end the owner of this one.
                auto node = fired->loop->timers_.extract(fired->id);
                node.mapped()->callback();
                return 0;
              },
              timer.get()),
          "add timer");
  timer->source.reset(source);
  const Id id = timer->id;
  timers_.emplace(id, std::move(timer));
  return id;
}

void EventLoop::cancel(Id id) { timers_.erase(id); }

EventLoop::Io::Io(EventLoop& loop, int fd, unsigned events, std::function<void(unsigned)> ready)
    : ready_(std::move(ready)), events_(events) {
  sd_event_source* source = nullptr;
  require(sd_event_add_io(loop.event_, &source, fd, events, &Io::on_ready, this), "watch descriptor");
  source_.reset(source);
}

int EventLoop::Io::on_ready(sd_event_source*, int, unsigned events, void* self) {
  static_cast<Io*>(self)->ready_(events);
  return 0;
}

void EventLoop::Io::want(unsigned events) {
  if (events == events_) {
    return;
  }
  events_ = events;
  require(sd_event_source_set_io_events(source_.get(), events), "change events");
}

void EventLoop::on_signal(int signal, std::function<void()> callback) {
  auto entry = std::make_unique<Callback>();
  entry->call = std::move(callback);
  sd_event_source* source = nullptr;
  require(sd_event_add_signal(
              event_, &source, signal,
              [](sd_event_source*, const signalfd_siginfo*, void* data) {
                static_cast<Callback*>(data)->call();
                return 0;
              },
              entry.get()),
          "add signal");
  entry->source.reset(source);
  callbacks_.push_back(std::move(entry));
}

void EventLoop::before_wait(std::function<void()> callback) {
  auto entry = std::make_unique<Callback>();
  entry->call = std::move(callback);
  sd_event_source* source = nullptr;
  // A post source runs after every other dispatch, that is before the loop waits again.
  require(sd_event_add_post(
              event_, &source,
              [](sd_event_source*, void* data) {
                static_cast<Callback*>(data)->call();
                return 0;
              },
              entry.get()),
          "add post source");
  entry->source.reset(source);
  callbacks_.push_back(std::move(entry));
}

bool EventLoop::enable_watchdog() { return sd_event_set_watchdog(event_, 1) > 0; }

int EventLoop::run() {
  const int status = sd_event_loop(event_);
  require(status, "run");
  return status;
}

void EventLoop::turn(std::chrono::microseconds longest) {
  require(sd_event_run(event_, static_cast<std::uint64_t>(longest.count())), "turn");
}

void EventLoop::stop(int exit_status) { require(sd_event_exit(event_, exit_status), "stop"); }

}  // namespace selfcal
