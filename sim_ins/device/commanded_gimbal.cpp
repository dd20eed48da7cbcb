#include "sim_ins/device/commanded_gimbal.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "estimator/geometry/units.hpp"
#include "sim_ins/gimbal.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::sim {
namespace {

constexpr std::uint64_t gimbal_stream = 2;  // as of a schedule
constexpr double shortest_move_s = 5.0;

}  // namespace

CommandedGimbal::CommandedGimbal(const SimConfig& config, std::uint64_t seed, const ConcealedPhysics& physics,
                                 const Scenario& scenario)
    : config_(config), seed_(seed), physics_(physics), scenario_(scenario), error_(seed, gimbal_stream) {}

void CommandedGimbal::stand(std::array<double, 2> where, double now_s) {
  epoch_s_ = now_s;
  initial_ = where;
  moves_.clear();
  motion_ = GimbalMotion(initial_, {});
}

void CommandedGimbal::power_on(double now_s) {
  imu_.reset();
  stand(angles(now_s), now_s);
}

// As long as a schedule's moves are by default, or a multiple of it where the drive needs more.
double CommandedGimbal::duration_of(const GimbalMove& move) const {
  const auto in_degrees = [](std::array<double, 2> rad) {
    return GimbalPosition{rad[0] / units::degree, rad[1] / units::degree};
  };
  constexpr double longest = 20 * shortest_move_s;
  Schedule one{{in_degrees(move.from), in_degrees(move.to)}, {1.0, 1.0}, shortest_move_s};
  while (one.rotation_s < longest && !check_schedule(config_.gimbal, one)) {
    one.rotation_s += shortest_move_s;
  }
  return one.rotation_s;
}

void CommandedGimbal::turn_to(std::array<double, 2> target, double now_s) {
  if (turning(now_s)) {
    return;
  }
  // Not before the samples that were told already.
  const double reached = static_cast<double>(samples_) / config_.sample_rate_hz;
  GimbalMove move;
  move.start_s = imu_ ? std::max(since_epoch(now_s), reached) : since_epoch(now_s);
  move.from = moves_.empty() ? initial_ : moves_.back().to;
  const double e = config_.gimbal.positioning_error_deg * units::degree;
  move.to = {target[0] + error_.uniform(-e, e), target[1] + error_.uniform(-e, e)};
  move.duration_s = duration_of(move);
  move.ramp_s = ramp_time(config_.gimbal, move.duration_s);
  moves_.push_back(move);
  const GimbalMotion planned(initial_, moves_);
  motion_ = imu_ ? spoil_gimbal(scenario_, planned) : planned;
  if (imu_) {
    repeat();
  }
}

Expected<void> CommandedGimbal::make_imu() {
  auto imu = ImuSimulator::create(config_, motion_, seed_, physics_);
  if (!imu) {
    return tl::unexpected(imu.error());
  }
  imu_ = std::make_unique<ImuSimulator>(std::move(*imu));
  return {};
}

// The same seed and the same moves so far give the same samples so far.
void CommandedGimbal::repeat() {
  if (!make_imu()) {
    std::abort();  // the same configuration was sound before
  }
  for (std::uint64_t k = 0; k < samples_; ++k) {
    imu_->next();
  }
}

Expected<void> CommandedGimbal::start(double now_s) {
  stand(angles(now_s), now_s);
  samples_ = 0;
  before_ = {};
  return make_imu();
}

void CommandedGimbal::stop(double now_s) {
  imu_.reset();
  stand(angles(now_s), now_s);
}

bool CommandedGimbal::turning(double now_s) const { return motion_.turning(since_epoch(now_s), since_epoch(now_s)); }

std::array<double, 2> CommandedGimbal::angles(double now_s) const { return motion_.at(since_epoch(now_s)).angle; }

std::vector<ImuSample> CommandedGimbal::take(double now_s) {
  std::vector<ImuSample> due;
  while (imu_ && static_cast<double>(samples_ + 1) / config_.sample_rate_hz <= since_epoch(now_s)) {
    ImuSample sample = imu_->next();
    ++samples_;
    spoil_sample(scenario_, static_cast<double>(samples_) / config_.sample_rate_hz, before_, sample);
    before_ = sample;
    due.push_back(sample);
  }
  return due;
}

}  // namespace selfcal::sim
