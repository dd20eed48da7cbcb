#include "daemon/ins/session_end.hpp"

#include <fmt/format.h>

#include <utility>

#include "protocol/uds/messages.hpp"

namespace selfcal {
namespace {

constexpr std::size_t longest_answer = 64;

}  // namespace

SessionEnd::~SessionEnd() { abandon(); }

void SessionEnd::abandon() {
  timers_.cancel(timer_);
  timer_ = 0;
  if (std::exchange(done_, {})) {
    port_.cancel();
  }
}

void SessionEnd::begin(std::function<void(const std::string& trouble)> done) {
  done_ = std::move(done);
  asked_ = 0;
  trouble_ = fmt::format("{}: no answer to DiagnosticSessionControl", port_.interface());
  port_.keep_session(false);
  ask();
}

void SessionEnd::ask() {
  timer_ = 0;
  port_.cancel();
  if (asked_ == attempts) {
    return finish(trouble_);
  }
  ++asked_;
  timer_ = timers_.after(interval, [this] { ask(); });
  port_.request(uds::session_request(uds::Session::standard), longest_answer, [this](const Answer<Bytes>& answer) {
    if (!answer) {
      trouble_ = answer.error().message;
      return;  // asked again when the interval is over
    }
    if (const auto read = uds::read_session_response(*answer, uds::Session::standard); !read) {
      trouble_ = read.error().message;
      return;
    }
    finish({});
  });
}

void SessionEnd::finish(const std::string& trouble) {
  timers_.cancel(timer_);
  timer_ = 0;
  const auto done = std::exchange(done_, {});
  done(trouble);
}

}  // namespace selfcal
