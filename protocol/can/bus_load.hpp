// Accounts for the time that frames hold a bus. The virtual INS paces itself by it, a monitor measures load with it.
#pragma once

#include <cstdint>

#include "protocol/can/bus_time.hpp"

namespace selfcal::can {

// The bus as a single server: a frame starts when it is offered or when the frame before it has ended.
class BusClock {
 public:
  explicit BusClock(const BitRates& rates) : rates_(rates) {}

  // The frame goes on the bus at `now` or as soon as the bus is free; returns when it has ended.
  Time transmit(const CanFrame& frame, Time now);

  Time free_at() const { return free_at_; }
  Time busy() const { return busy_; }  // sum of all frames so far
  std::uint64_t frames() const { return frames_; }
  const BitRates& rates() const { return rates_; }

 private:
  BitRates rates_;
  Time free_at_{0};
  Time busy_{0};
  std::uint64_t frames_ = 0;
};

}  // namespace selfcal::can
