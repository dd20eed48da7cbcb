// A schedule turned move by move: which position is commanded when, and whether the INS is there. It is told the time, in seconds
// of the INS's clock, and knows none itself.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "protocol/ins_interface/records.hpp"
#include "protocol/profile/frames.hpp"
#include "protocol/profile/turning.hpp"

namespace selfcal {

class MoveSequence {
 public:
  enum class Phase : std::uint8_t { none, approaching, dwelling, moving, over, failed };

  // The first position is to be commanded now, before any data are taken.
  void begin(ins::ScheduleRecord schedule, const profile::Turning& turning, double now_s = 0.0);
  // The data begin: the first dwell counts from here on.
  void data_begin(double now_s) { arrive(now_s); }
  void stop() { phase_ = phase_ == Phase::over || phase_ == Phase::failed ? phase_ : Phase::none; }
  void fail(std::string why);

  // Time went by; the gimbal's angles, where they are told. True: target() is to be commanded.
  bool on_time(double now_s, const std::array<double, 2>* gimbal_rad);
  // The INS told its state; its gimbal angles, where it told them with it.
  void on_state(double now_s, profile::FrameState state, const std::array<double, 2>* gimbal_rad);

  Phase phase() const { return phase_; }
  bool active() const { return phase_ == Phase::dwelling || phase_ == Phase::moving; }
  std::array<double, 2> target() const;             // radians
  std::size_t position() const { return at_ + 1; }  // a move belongs to the position that it leads to
  const std::string& why() const { return why_; }
  double dwell_end_s() const { return dwell_end_s_; }
  // By the schedule, until the end of its last dwell; on the way to a position all of the move is yet to come.
  double left_s(double now_s) const;
  // The angles have stayed where they are, as they were told.
  bool rests(double now_s) const;

 private:
  bool near(std::array<double, 2> gimbal_rad) const;
  void watch_rest(double now_s, std::array<double, 2> gimbal_rad);
  void arrive(double now_s);

  ins::ScheduleRecord schedule_;
  profile::Turning turning_;
  Phase phase_ = Phase::none;
  std::size_t at_ = 0;
  double commanded_s_ = 0.0, dwell_end_s_ = 0.0;
  double rest_from_s_ = 0.0;  // the gimbal stays since then about
  std::array<double, 2> rest_at_{};
  int rests_ = 0;  // states in a row that say so, since the command
  std::string why_;
};

}  // namespace selfcal
