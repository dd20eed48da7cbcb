#include "daemon/run/rotation_clock.hpp"

#include <chrono>

namespace selfcal {
namespace {

double seconds(SteadyTime from, SteadyTime to) { return std::chrono::duration<double>(to - from).count(); }

}  // namespace

void RotationClock::start_asked(SteadyTime now) {
  *this = {};
  start_asked_ = now;
}

void RotationClock::state_told(bool rotating, SteadyTime asked, SteadyTime answered) {
  if (rotating) {
    turned_from_ = turned_from_.value_or(answered);
    turned_until_ = asked;
    over_.reset();
  } else if (!over_ && (start_asked_ || turned_from_)) {
    over_ = answered;
  }
}

RotationTime RotationClock::time() const {
  RotationTime time;
  if (turned_from_ && *turned_until_ > *turned_from_) {
    time.least_s = seconds(*turned_from_, *turned_until_);
  }
  if (start_asked_ && over_) {
    time.most_s = seconds(*start_asked_, *over_);
  }
  return time;
}

}  // namespace selfcal
