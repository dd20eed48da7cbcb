#include "daemon/run/budget_watch.hpp"

#include <algorithm>

namespace selfcal {

void BudgetWatch::come_to(State state) {
  state_ = state;
  if (state <= State::checking_new) {
    main_path_ = state;
  }
}

void BudgetWatch::begin(State state) {
  come_to(state);
  progressed();
}

bool BudgetWatch::enter(State state) {
  if (state <= state_) {
    return false;
  }
  come_to(state);
  progressed();
  return true;
}

void BudgetWatch::progressed() {
  progressed_at_ = timers_.now();
  extension_ = SteadyTime(0);
  watch();
}

void BudgetWatch::learn_page(double seconds_of_data) {
  page_s_ = seconds_of_data;
  watch();
}

void BudgetWatch::extend(std::chrono::nanoseconds time) {
  extension_ += time;
  watch();
}

void BudgetWatch::watch() {
  timers_.cancel(timer_);
  timer_ = 0;
  if (is_final(state_)) {
    return;
  }
  const auto budget =
      std::chrono::duration_cast<SteadyTime>(std::chrono::duration<double>(budget_s(state_, config_, page_s_)));
  const SteadyTime left = std::max(progressed_at_ + budget + extension_ - timers_.now(), SteadyTime(0));
  timer_ = timers_.after(left, [this] {
    timer_ = 0;
    spent_(std::chrono::duration<double>(timers_.now() - progressed_at_).count());
  });
}

}  // namespace selfcal
