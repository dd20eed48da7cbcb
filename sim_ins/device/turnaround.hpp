// What a tester takes from the end of an answer to its next request, in INS time. While it is the tester's turn in an
// upload the clock of the INS stands, so that a slow host is not charged; its real turnaround is added here.
#pragma once

#include <algorithm>

#include "protocol/can/frame.hpp"

namespace selfcal::sim {

class Turnaround {
 public:
  explicit Turnaround(double milliseconds) : seconds_(milliseconds / 1000.0) {}

  void answer_sent() { answered_ = true; }  // a frame of it
  // The time at which the tester's frame comes, where the clock shows now_s and the bus has been free since free_s.
  double heard(const can::CanFrame& frame, double now_s, double free_s) {
    if (frame.size > 0 && frame.data[0] >> 4 == 3) {  // flow control comes from the tester's driver, at once
      return now_s;
    }
    const bool charged = answered_;
    answered_ = false;
    return charged ? std::max(now_s, free_s + seconds_) : now_s;
  }

 private:
  double seconds_;
  bool answered_ = false;
};

}  // namespace selfcal::sim
