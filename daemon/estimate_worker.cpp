#include "daemon/estimate_worker.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace selfcal {

EstimateWorker::Mailbox::~Mailbox() {
  if (wake_fd >= 0) close(wake_fd);
}

void EstimateWorker::Mailbox::wake() const {
  const std::uint64_t one = 1;
  // The counter cannot overflow here, so the write cannot fail.
  [[maybe_unused]] const auto written = write(wake_fd, &one, sizeof one);
}

EstimateWorker::EstimateWorker(EventLoop& loop) : loop_(loop) {}

EstimateWorker::~EstimateWorker() { cancel(); }

void EstimateWorker::start(EstimateJob job, EstimateProgress on_progress,
                           std::function<void(Expected<Estimate>)> on_done) {
  cancel();
  on_progress_ = std::move(on_progress);
  on_done_ = std::move(on_done);
  auto mailbox = std::make_shared<Mailbox>();
  mailbox->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (mailbox->wake_fd < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  mailbox_ = mailbox;
  wake_ = std::make_unique<EventLoop::Io>(loop_, mailbox->wake_fd, EPOLLIN, [this](unsigned) { collect(); });
  thread_ = std::jthread([mailbox, job = std::move(job)](std::stop_token stop) {
    auto answer = job(
        [&mailbox](const CalibrationProgress& progress) {
          const std::lock_guard lock(mailbox->mutex);
          mailbox->progress = progress;
          mailbox->wake();
        },
        stop);
    const std::lock_guard lock(mailbox->mutex);
    mailbox->answer = std::move(answer);
    mailbox->wake();
  });
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
  std::optional<CalibrationProgress> progress;
  std::optional<Expected<Estimate>> answer;
  {
    const std::lock_guard lock(mailbox_->mutex);
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = read(mailbox_->wake_fd, &count, sizeof count);
    progress.swap(mailbox_->progress);
    answer.swap(mailbox_->answer);
  }
  if (progress && on_progress_) on_progress_(*progress);
  if (answer) {
    // Copied out: the callback may start the next job or end this worker.
    const auto done = on_done_;
    done(std::move(*answer));
  }
}

}  // namespace selfcal
