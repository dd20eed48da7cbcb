#include "sim_ins/device/instrument.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/geometry/units.hpp"
#include "sim_ins/gimbal.hpp"
#include "sim_ins/random.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

constexpr double start_up_s = 1.0;
constexpr std::uint64_t gimbal_stream = 2;  // as simulate(): the same seed gives the same recording

std::uint16_t gimbal_counts(double angle) {
  const double turns = angle / (360.0 * units::degree);
  return static_cast<std::uint16_t>(std::llround((turns - std::floor(turns)) * flash::counts_per_turn) % 65536);
}

Schedule as_schedule(const ins::ScheduleRecord& record) {
  Schedule schedule;
  schedule.rotation_s = record.rotation_ms / 1000.0;
  for (const auto& p : record.positions) {
    schedule.positions.push_back({p.outer_mdeg / 1000.0, p.inner_mdeg / 1000.0});
    schedule.dwell_s.push_back(p.dwell_ms / 1000.0);
  }
  return schedule;
}

double degrees_in_turn(double radians) {
  const double degrees = std::fmod(radians / units::degree, 360.0);
  return degrees < 0.0 ? degrees + 360.0 : degrees;
}

}  // namespace

Instrument::Instrument(const SimConfig& config, std::uint64_t seed, const ConcealedPhysics& physics, FlashMemory flash,
                       const Scenario& scenario, std::size_t samples_per_page)
    : config_(config),
      seed_(seed),
      physics_(physics),
      scenario_(scenario),
      samples_per_page_(samples_per_page),
      flash_(std::move(flash)),
      coefficients_(flash_),
      counters_(flash_),
      raw_(flash_, samples_per_page),
      site_{config.latitude_deg, config.longitude_deg, config.height_m} {}

Expected<std::unique_ptr<Instrument>> Instrument::create(const SimConfig& config, std::uint64_t seed,
                                                         const ConcealedPhysics& physics, FlashMemory flash,
                                                         const Scenario& scenario, std::size_t samples_per_page) {
  std::unique_ptr<Instrument> instrument(
      new Instrument(config, seed, physics, std::move(flash), scenario, samples_per_page));
  // Proves configuration and physics before anybody relies on them.
  if (auto imu = instrument->make_imu({{GimbalPosition{}}, {1.0}, 5.0}, {}); !imu) {
    return tl::unexpected(imu.error());
  }
  ins::Coefficients factory;
  factory.author = "factory";
  instrument->coefficients_.write_factory_if_blank(factory);
  instrument->flash_.advance(instrument->flash_.ready_at_s());  // at the works, with all the time it takes
  return instrument;
}

Expected<std::unique_ptr<ImuSimulator>> Instrument::make_imu(const Schedule& schedule, const Scenario& scenario) const {
  Random random(seed_, gimbal_stream);
  const GimbalMotion planned = plan_gimbal(config_.gimbal, schedule, random);
  auto imu = ImuSimulator::create(config_, spoil_gimbal(scenario, planned), seed_, physics_);
  if (!imu) {
    return tl::unexpected(imu.error());
  }
  return std::make_unique<ImuSimulator>(std::move(*imu));
}

void Instrument::power_on(double now_s) {
  flash_.cut_power(now_s);  // the line that resets the processor resets the chip
  imu_.reset();
  if (gimbal_) {
    gimbal_->power_on(now_s);
  }
  now_s_ = now_s;
  navigation_.reset();
  check_ = {};
  schedule_.reset();
  page_ = {};
  stopped_at_s_.reset();
  coefficients_.power_on();
  counters_.power_on();
  counters_.set(counters_.get().power_cycles + 1, counters_.get().key_attempts);
  raw_.power_on();
  run_id_ = raw_.directory().run_id;
  faults_ = coefficients_.fell_back() ? ins::fault::coefficients : std::uint8_t{0};
  state_ = ins::State::starting;
  ready_at_s_ = std::max(now_s + start_up_s, flash_.ready_at_s());
}

Expected<void> Instrument::check_schedule(const ins::ScheduleRecord& schedule) const {
  return sim::check_schedule(config_.gimbal, as_schedule(schedule));
}

Expected<void> Instrument::move_to(const ins::MoveRecord& position, double now_s) {
  constexpr double radians_per_mdeg = units::degree / 1000.0;
  if (!ready() || state_ == ins::State::checking || gimbal_->turning(now_s)) {
    return fail(ErrorKind::device, fmt::format("state {}", ins::name(state_)));
  }
  gimbal_->turn_to({position.outer_mdeg * radians_per_mdeg, position.inner_mdeg * radians_per_mdeg}, now_s);
  return {};
}

Expected<void> Instrument::begin_recording(std::uint32_t run_id, double now_s) {
  if (auto started = gimbal_->start(now_s); !started) {
    return started;
  }
  samples_wanted_ = 0;  // nobody knows
  raw_.begin(run_id, 0);
  return {};
}

Expected<void> Instrument::start_rotation(std::uint32_t run_id, double now_s) {
  if (!ready() || busy()) {
    return fail(ErrorKind::device, fmt::format("state {}", ins::name(state_)));
  }
  if (gimbal_) {
    return begin_recording(run_id, now_s).map([&] { rotate(run_id, now_s, std::nullopt); });
  }
  if (!schedule_) {
    return fail(ErrorKind::device, "no schedule");
  }
  const Schedule schedule = as_schedule(*schedule_);
  auto imu = make_imu(schedule, scenario_);
  if (!imu) {
    return tl::unexpected(imu.error());
  }
  imu_ = std::move(*imu);
  samples_wanted_ = static_cast<std::uint64_t>(std::llround(schedule.duration_s() * config_.sample_rate_hz));
  const std::uint64_t pages = (samples_wanted_ + samples_per_page_ - 1) / samples_per_page_;
  raw_.begin(run_id, static_cast<std::uint32_t>(pages));
  rotate(run_id, now_s, gimbal_failure_time(scenario_, schedule));
  return {};
}

void Instrument::rotate(std::uint32_t run_id, double now_s, std::optional<double> gimbal_noticed_s) {
  epoch_s_ = now_s;
  samples_ = 0;
  run_id_ = run_id;
  for (const Fault& fault : scenario_.faults) {
    if (fault.kind == FaultKind::spoilt_page) {
      raw_.spoil(static_cast<std::uint32_t>(fault.value), std::max(1, static_cast<int>(fault.amount)));
    }
  }
  page_ = {};
  stopped_at_s_.reset();
  gimbal_noticed_s_ = gimbal_noticed_s;
  faults_ = 0;
  state_ = ins::State::rotating;
}

void Instrument::stop_rotation() {
  if (state_ == ins::State::rotating) {
    finish_rotation(gimbal_ ? ins::State::complete : ins::State::aborted);
  }
  if (gimbal_) {
    gimbal_->stop(now_s_);
  }
}

void Instrument::stop_check() {
  if (state_ == ins::State::checking) {
    navigation_.reset();
    state_ = ins::State::idle;
  }
}

void Instrument::finish_rotation(ins::State state) {
  flush_page(true);
  raw_.end();
  stopped_at_s_ = epoch_s_ + static_cast<double>(samples_) / config_.sample_rate_hz;
  state_ = state;
}

void Instrument::flush_page(bool last) {
  if (page_.samples.empty()) {
    return;
  }
  page_.run_id = run_id_;
  page_.sequence = raw_.pages_written();
  page_.first_sample = samples_ - page_.samples.size();
  page_.temperature_c = last_sample_.temperature_c;
  page_.flags = static_cast<std::uint16_t>(page_.flags | (last ? flash::page_flag::last_of_run : 0));
  flash_.advance(epoch_s_ + static_cast<double>(samples_) / config_.sample_rate_hz);
  raw_.append(page_);
  page_.samples.clear();
  page_.flags = 0;
}

void Instrument::keep_sample(const ImuSample& sample) {
  last_sample_ = sample;
  ++samples_;
  if (keeps_stream_) {
    stream_.push_back(sample);
  }
  if (!sample.missing) {
    page_.samples.push_back(
        {sample.delta_theta, sample.delta_v, gimbal_counts(sample.outer), gimbal_counts(sample.inner)});
  }
  if (page_.samples.size() == samples_per_page_) {
    flush_page(samples_ == samples_wanted_);
  }
}

// Faults of the sensors are in the samples already.
void Instrument::record_moves(double now_s) {
  for (const ImuSample& sample : gimbal_->take(now_s)) {
    keep_sample(sample);
  }
}

void Instrument::take_sample() {
  ImuSample sample = imu_->next();
  const double t = static_cast<double>(samples_ + 1) / config_.sample_rate_hz;
  if (spoil_sample(scenario_, t, last_sample_, sample)) {
    page_.flags |= flash::page_flag::sensor_saturated;
  }
  keep_sample(sample);
  if (gimbal_noticed_s_ && t > *gimbal_noticed_s_) {
    faults_ |= ins::fault::gimbal;
    finish_rotation(ins::State::failed);
  } else if (samples_ == samples_wanted_) {
    finish_rotation(ins::State::complete);
  }
}

void Instrument::advance(double now_s) {
  if (state_ == ins::State::starting && now_s >= ready_at_s_) {
    state_ = ins::State::idle;
  }
  now_s_ = now_s;
  if (gimbal_ && state_ == ins::State::rotating) {
    record_moves(now_s);
  }
  while (!gimbal_ && state_ == ins::State::rotating &&
         epoch_s_ + static_cast<double>(samples_ + 1) / config_.sample_rate_hz <= now_s) {
    take_sample();
  }
  if (state_ == ins::State::checking) {
    navigate_until(now_s);
  }
  flash_.advance(now_s);
}

Expected<void> Instrument::start_navigation_check(const ins::NavigationCheckRequest& request, double now_s) {
  if (!ready() || busy()) {
    return fail(ErrorKind::device, fmt::format("state {}", ins::name(state_)));
  }
  const Schedule still{{GimbalPosition{}}, {static_cast<double>(request.duration_s)}, 5.0};
  auto imu = make_imu(still, {});
  if (!imu) {
    return tl::unexpected(imu.error());
  }
  imu_ = std::move(*imu);
  const auto set =
      request.compensation == ins::Slot::factory ? coefficients_.factory() : std::optional(coefficients_.in_force());
  const earth::Position start{config_.latitude_deg * units::degree, config_.longitude_deg * units::degree,
                              config_.height_m};
  navigation_ = std::make_unique<FreeInertialNavigation>(start, imu_->motion().at(0.0).C_nb,
                                                         set.value_or(ins::Coefficients{}).value);
  check_ = {};
  epoch_s_ = now_s;
  samples_ = 0;
  samples_wanted_ = static_cast<std::uint64_t>(std::llround(request.duration_s * config_.sample_rate_hz));
  state_ = ins::State::checking;
  return {};
}

void Instrument::navigate_until(double now_s) {
  const double dt = 1.0 / config_.sample_rate_hz;
  const double theta_lsb = config_.gyro_lsb_arcsec * units::arcsecond;
  const auto scaled = [](const std::array<std::int32_t, 3>& counts, double lsb) {
    return Vector3(counts[0] * lsb, counts[1] * lsb, counts[2] * lsb);
  };
  while (samples_ < samples_wanted_ && epoch_s_ + static_cast<double>(samples_ + 1) * dt <= now_s) {
    const ImuSample sample = imu_->next();
    navigation_->step(scaled(sample.delta_theta, theta_lsb), scaled(sample.delta_v, config_.accel_lsb_m_per_s), dt);
    ++samples_;
  }
  check_.elapsed_s = static_cast<double>(samples_) * dt;
  check_.north_m = navigation_->north_m();
  check_.east_m = navigation_->east_m();
  check_.max_horizontal_m = navigation_->max_horizontal_m();
  if (samples_ == samples_wanted_) {
    check_.done = true;
    navigation_.reset();
    state_ = ins::State::idle;
  }
}

ins::Status Instrument::status() const {
  ins::Status status;
  status.state = state_;
  status.faults = faults_;
  status.pages_written = raw_.pages_written();
  if (gimbal_) {
    const auto angles = gimbal_->angles(now_s_);
    status.outer_deg = degrees_in_turn(angles[0]);
    status.inner_deg = degrees_in_turn(angles[1]);
    status.moving = gimbal_->turning(now_s_);
  } else if (imu_) {
    const double t = static_cast<double>(samples_) / config_.sample_rate_hz;
    const GimbalMotion& gimbal = imu_->motion().gimbal();
    const GimbalState now = gimbal.at(t);
    status.outer_deg = degrees_in_turn(now.angle[0]);
    status.inner_deg = degrees_in_turn(now.angle[1]);
    if (state_ == ins::State::rotating) {
      const int move = gimbal.last_move(t);
      status.position = static_cast<std::uint8_t>(std::clamp(move + 2, 1, 255));
      status.moving = gimbal.turning(t, t + 1e-6);
      status.time_left_s = static_cast<double>(samples_wanted_ - samples_) / config_.sample_rate_hz;
    }
  }
  return status;
}

ins::StateRecord Instrument::state_record() const {
  constexpr double turn_deg = 360.0;
  const ins::Status now = status();
  return {state_,
          faults_,
          coefficients_.in_force_slot(),
          coefficients_.in_force().version,
          coefficients_.in_force_crc(),
          run_id_,
          counters_.get().power_cycles,
          now.moving,
          std::remainder(now.outer_deg, turn_deg),
          std::remainder(now.inner_deg, turn_deg)};
}

ins::RunRecord Instrument::run_record() const {
  return {state_, faults_, status().position, run_id_, raw_.pages_written()};
}

ins::SampleFormatRecord Instrument::sample_format() const {
  return {config_.sample_rate_hz,
          config_.gyro_lsb_arcsec * units::arcsecond,
          config_.accel_lsb_m_per_s,
          360.0 * units::degree / flash::counts_per_turn,
          static_cast<std::uint32_t>(flash::page_bytes),
          static_cast<std::uint16_t>(samples_per_page_)};
}

}  // namespace selfcal::sim
