// A schedule turned move by move: which position is commanded when, and whether the INS is there. It counts the INS's time in
// samples and knows no clock.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "protocol/ins_interface/records.hpp"
#include "protocol/profile/frames.hpp"

namespace selfcal {

class MoveSequence {
 public:
  struct Rule {
    bool by_angle = true;  // else by the state
    double tolerance_rad = 0.0;
    double rest_rad = 0.0;  // it rests while its angles stay so near to each other
    double longest_move_s = 60.0;
    double sample_rate_hz = 0.0;
  };
  enum class Phase : std::uint8_t { none, approaching, dwelling, moving, over, failed };

  // The first position is to be commanded, before the stream begins. Angles are the INS's.
  void begin(ins::ScheduleRecord schedule, const Rule& rule);
  void stop() { phase_ = phase_ == Phase::over || phase_ == Phase::failed ? phase_ : Phase::none; }
  void fail(std::string why);

  // A sample came, so many there are now. True: target() is to be commanded.
  bool on_sample(std::uint64_t samples, std::array<double, 2> gimbal_rad);
  // A state frame came; its gimbal angles, where it has them.
  void on_state(std::uint64_t samples, profile::FrameState state, const std::array<double, 2>* gimbal_rad);

  Phase phase() const { return phase_; }
  bool active() const { return phase_ == Phase::dwelling || phase_ == Phase::moving; }
  std::array<double, 2> target() const;             // radians
  std::size_t position() const { return at_ + 1; }  // a move belongs to the position that it leads to
  const std::string& why() const { return why_; }

 private:
  bool near(std::array<double, 2> gimbal_rad) const;
  void watch_rest(std::uint64_t samples, std::array<double, 2> gimbal_rad);
  void arrive(std::uint64_t samples);

  ins::ScheduleRecord schedule_;
  Rule rule_;
  Phase phase_ = Phase::none;
  std::size_t at_ = 0;
  std::uint64_t commanded_ = 0, dwell_end_ = 0;  // samples
  std::uint64_t rest_from_ = 0;                  // samples; the gimbal stays since then about
  std::array<double, 2> rest_at_{};
  int rests_ = 0;  // state frames in a row that say so, since the command
  std::string why_;
};

}  // namespace selfcal
