#include "daemon/ins/move_sequence.hpp"

#include <fmt/format.h>

#include <cmath>

namespace selfcal {
namespace {

constexpr double turn = 2.0 * 3.14159265358979323846;
constexpr double radians_per_mdeg = turn / 360e3;
// One state frame may have been on its way when the move was commanded.
constexpr int rests_wanted = 2;
constexpr double rest_s = 0.2;  // for so long the angles stay

double degrees(double radians) { return radians * 360.0 / turn; }

}  // namespace

void MoveSequence::begin(ins::ScheduleRecord schedule, const Rule& rule) {
  *this = {};
  schedule_ = std::move(schedule);
  rule_ = rule;
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
  return std::abs(std::remainder(gimbal_rad[0] - wanted[0], turn)) <= rule_.tolerance_rad &&
         std::abs(std::remainder(gimbal_rad[1] - wanted[1], turn)) <= rule_.tolerance_rad;
}

void MoveSequence::arrive(std::uint64_t samples) {
  phase_ = Phase::dwelling;
  dwell_end_ = samples + static_cast<std::uint64_t>(
                             std::llround(schedule_.positions[at_].dwell_ms * 1e-3 * rule_.sample_rate_hz));
}

void MoveSequence::watch_rest(std::uint64_t samples, std::array<double, 2> gimbal_rad) {
  const bool stays = std::abs(std::remainder(gimbal_rad[0] - rest_at_[0], turn)) <= rule_.rest_rad &&
                     std::abs(std::remainder(gimbal_rad[1] - rest_at_[1], turn)) <= rule_.rest_rad;
  if (!stays) {
    rest_at_ = gimbal_rad;
    rest_from_ = samples;
  }
  const double rested_s = static_cast<double>(samples - rest_from_) / rule_.sample_rate_hz;
  if (phase_ == Phase::moving && rule_.by_angle && near(gimbal_rad) && rested_s >= rest_s && rest_from_ > commanded_) {
    arrive(rest_from_);
  }
}

bool MoveSequence::on_sample(std::uint64_t samples, std::array<double, 2> gimbal_rad) {
  watch_rest(samples, gimbal_rad);
  const double moved_s = static_cast<double>(samples - commanded_) / rule_.sample_rate_hz;
  if (phase_ == Phase::moving && moved_s > rule_.longest_move_s) {
    fail(fmt::format("position {} is not reached within {:g} s: the gimbal is at {:.2f} and {:.2f} deg", position(),
                     rule_.longest_move_s, degrees(gimbal_rad[0]), degrees(gimbal_rad[1])));
  }
  if (phase_ != Phase::dwelling || samples < dwell_end_) {
    return false;
  }
  if (rule_.by_angle && !near(gimbal_rad)) {
    fail(fmt::format("position {} is left before its time: the gimbal is at {:.2f} and {:.2f} deg", position(),
                     degrees(gimbal_rad[0]), degrees(gimbal_rad[1])));
    return false;
  }
  if (at_ + 1 == schedule_.positions.size()) {
    phase_ = Phase::over;
    return false;
  }
  ++at_;
  phase_ = Phase::moving;
  commanded_ = samples;
  rests_ = 0;
  return true;
}

void MoveSequence::on_state(std::uint64_t samples, profile::FrameState state, const std::array<double, 2>* gimbal_rad) {
  const bool waits = phase_ == Phase::approaching || phase_ == Phase::moving;
  if (state == profile::FrameState::failed && (waits || phase_ == Phase::dwelling)) {
    return fail(fmt::format("at position {} the INS says that it failed", position()));
  }
  if (!waits) {
    return;
  }
  const bool there = gimbal_rad == nullptr || !rule_.by_angle || near(*gimbal_rad);
  rests_ = state == profile::FrameState::idle && there ? rests_ + 1 : 0;
  if (rests_ >= rests_wanted && (phase_ == Phase::approaching || (phase_ == Phase::moving && !rule_.by_angle))) {
    arrive(samples);
  }
}

}  // namespace selfcal
