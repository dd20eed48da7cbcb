#include "protocol/can/bus_load.hpp"

#include <algorithm>

namespace selfcal::can {

Time BusClock::transmit(const CanFrame& frame, Time now) {
  const Time duration = frame_time(frame, rates_);
  free_at_ = std::max(free_at_, now) + duration;
  busy_ += duration;
  ++frames_;
  return free_at_;
}

}  // namespace selfcal::can
