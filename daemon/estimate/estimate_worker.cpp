#include "daemon/estimate/estimate_worker.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <system_error>

namespace selfcal {
namespace {

constexpr int background_nice = 10;

}  // namespace

EstimateWorker::Mailbox::~Mailbox() {
  if (wake_fd >= 0) {
    close(wake_fd);
  }
}

void EstimateWorker::Mailbox::put(Delivery Mailbox::*slot, Delivery delivery) {
  const std::lock_guard lock(mutex);
  this->*slot = std::move(delivery);
  const std::uint64_t one = 1;
  // The counter cannot overflow here, so the write cannot fail.
  [[maybe_unused]] const auto written = write(wake_fd, &one, sizeof one);
}

EstimateWorker::EstimateWorker(EventLoop& loop) : loop_(loop) {}

EstimateWorker::~EstimateWorker() { cancel(); }

void EstimateWorker::start(EstimateJob job, EstimateProgress on_progress,
                           std::function<void(Expected<Estimate>)> on_done) {
  launch([job = std::move(job), on_progress = std::move(on_progress), on_done = std::move(on_done)](
             Mailbox& mailbox, const std::stop_token& stop) {
    auto answer = std::make_shared<Expected<Estimate>>(job(
        [&](const CalibrationProgress& progress) {
          mailbox.put(&Mailbox::progress, [on_progress, progress] { on_progress(progress); });
        },
        stop));
    mailbox.put(&Mailbox::answer, [on_done, answer] { on_done(std::move(*answer)); });
  });
}

void EstimateWorker::start_running(RunningJob job, RunningDone on_done) {
  launch([job = std::move(job), on_done = std::move(on_done)](Mailbox& mailbox, const std::stop_token& stop) {
    // Of this thread alone; without it the estimate is only less polite.
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), background_nice);
    auto answer = std::make_shared<Expected<RunningEstimate>>(job(stop));
    timespec used{};  // by this thread, which does nothing else
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
    const double cpu_s = static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
    mailbox.put(&Mailbox::answer, [on_done, answer, cpu_s] { on_done(std::move(*answer), cpu_s); });
  });
}

void EstimateWorker::launch(std::function<void(Mailbox&, std::stop_token)> work) {
  cancel();
  auto mailbox = std::make_shared<Mailbox>();
  mailbox->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (mailbox->wake_fd < 0) {
    throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  mailbox_ = mailbox;
  wake_ = std::make_unique<EventLoop::Io>(loop_, mailbox->wake_fd, EPOLLIN, [this](unsigned) { collect(); });
  thread_ = std::jthread([mailbox, work = std::move(work)](std::stop_token stop) { work(*mailbox, std::move(stop)); });
}

// Waits for the thread: the estimator looks at its token several times a second.
void EstimateWorker::cancel() {
  wake_.reset();
  if (thread_.joinable()) {
    thread_.request_stop();
    thread_.join();
  }
  mailbox_.reset();
}

void EstimateWorker::collect() {
  Delivery progress, answer;
  {
    const std::lock_guard lock(mailbox_->mutex);
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = read(mailbox_->wake_fd, &count, sizeof count);
    progress.swap(mailbox_->progress);
    answer.swap(mailbox_->answer);
  }
  if (progress) {
    progress();
  }
  // The last word: it may start the next job or end this worker.
  if (answer) {
    answer();
  }
}

}  // namespace selfcal
