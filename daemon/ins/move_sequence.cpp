#include "daemon/ins/move_sequence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selfcal {
namespace {

constexpr double turn = 2.0 * 3.14159265358979323846;
constexpr double radians_per_mdeg = turn / 360e3;
// One state may have been on its way when the move was commanded.
constexpr int rests_wanted = 2;
constexpr double rest_s = 0.2;  // for so long the angles stay
// Sums of sample intervals in binary: far less than one, far more than they are wrong by.
constexpr double rounding_s = 1e-6;

double degrees(double radians) { return radians * 360.0 / turn; }

std::string words_of(const std::array<double, 2>* gimbal_rad) {
  return gimbal_rad == nullptr ? std::string()
                               : fmt::format(": the gimbal is at {:.2f} and {:.2f} deg", degrees((*gimbal_rad)[0]),
                                             degrees((*gimbal_rad)[1]));
}

}  // namespace

void MoveSequence::begin(ins::ScheduleRecord schedule, const profile::Turning& turning, double now_s) {
  *this = {};
  schedule_ = std::move(schedule);
  turning_ = turning;
  commanded_s_ = rest_from_s_ = now_s;
  phase_ = Phase::approaching;
}

void MoveSequence::fail(std::string why) {
  phase_ = Phase::failed;
  why_ = std::move(why);
}

std::array<double, 2> MoveSequence::target() const {
  const auto& position = schedule_.positions[at_];
  return {position.outer_mdeg * radians_per_mdeg, position.inner_mdeg * radians_per_mdeg};
}

bool MoveSequence::near(std::array<double, 2> gimbal_rad) const {
  const auto wanted = target();
  return std::abs(std::remainder(gimbal_rad[0] - wanted[0], turn)) <= turning_.tolerance_rad &&
         std::abs(std::remainder(gimbal_rad[1] - wanted[1], turn)) <= turning_.tolerance_rad;
}

void MoveSequence::arrive(double now_s) {
  phase_ = Phase::dwelling;
  dwell_end_s_ = now_s + schedule_.positions[at_].dwell_ms * 1e-3;
}

double MoveSequence::left_s(double now_s) const {
  const bool dwells = phase_ == Phase::dwelling;
  if (!dwells && phase_ != Phase::moving && phase_ != Phase::approaching) {
    return 0.0;
  }
  const double move_s = schedule_.rotation_ms * 1e-3;
  const double here_s = schedule_.positions[at_].dwell_ms * 1e-3;
  double left = dwells ? std::max(0.0, dwell_end_s_ - now_s) : here_s + (at_ > 0 ? move_s : 0.0);
  for (std::size_t k = at_ + 1; k < schedule_.positions.size(); ++k) {
    left += move_s + schedule_.positions[k].dwell_ms * 1e-3;
  }
  return left;
}

bool MoveSequence::rests(double now_s) const { return now_s - rest_from_s_ >= rest_s - rounding_s; }

// Of a move that is none, because the gimbal is there already, the rest counts from the command on.
void MoveSequence::watch_rest(double now_s, std::array<double, 2> gimbal_rad) {
  const bool stays = std::abs(std::remainder(gimbal_rad[0] - rest_at_[0], turn)) <= turning_.rest_rad &&
                     std::abs(std::remainder(gimbal_rad[1] - rest_at_[1], turn)) <= turning_.rest_rad;
  if (!stays) {
    rest_at_ = gimbal_rad;
    rest_from_s_ = now_s;
  }
  const bool waits = phase_ == Phase::approaching || phase_ == Phase::moving;
  const double since_s = std::max(rest_from_s_, commanded_s_);
  if (waits && turning_.by_angle && near(gimbal_rad) && now_s - since_s >= rest_s - rounding_s) {
    arrive(since_s);
  }
}

bool MoveSequence::on_time(double now_s, const std::array<double, 2>* gimbal_rad) {
  if (gimbal_rad != nullptr) {
    watch_rest(now_s, *gimbal_rad);
  }
  const bool waits = phase_ == Phase::approaching || phase_ == Phase::moving;
  if (waits && now_s - commanded_s_ > turning_.longest_move_s + rounding_s) {
    fail(fmt::format("position {} is not reached within {:g} s{}", position(), turning_.longest_move_s,
                     words_of(gimbal_rad)));
  }
  if (phase_ != Phase::dwelling || now_s < dwell_end_s_ - rounding_s) {
    return false;
  }
  if (turning_.by_angle && gimbal_rad != nullptr && !near(*gimbal_rad)) {
    fail(fmt::format("position {} is left before its time{}", position(), words_of(gimbal_rad)));
    return false;
  }
  if (at_ + 1 == schedule_.positions.size()) {
    phase_ = Phase::over;
    return false;
  }
  ++at_;
  phase_ = Phase::moving;
  commanded_s_ = now_s;
  rests_ = 0;
  return true;
}

void MoveSequence::on_state(double now_s, profile::FrameState state, const std::array<double, 2>* gimbal_rad) {
  const bool waits = phase_ == Phase::approaching || phase_ == Phase::moving;
  if (state == profile::FrameState::failed && (waits || phase_ == Phase::dwelling)) {
    return fail(fmt::format("at position {} the INS says that it failed", position()));
  }
  if (!waits) {
    return;
  }
  const bool there = gimbal_rad == nullptr || !turning_.by_angle || near(*gimbal_rad);
  rests_ = state == profile::FrameState::idle && there ? rests_ + 1 : 0;
  if (rests_ >= rests_wanted && (phase_ == Phase::approaching || (phase_ == Phase::moving && !turning_.by_angle))) {
    arrive(now_s);
  }
}

}  // namespace selfcal
