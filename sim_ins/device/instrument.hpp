// The INS on its own clock: gimbal, IMU, FLASH, navigation. Knows nothing of CAN.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "protocol/error.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/ins_interface/status.hpp"
#include "sim_ins/config.hpp"
#include "sim_ins/device/commanded_gimbal.hpp"
#include "sim_ins/device/navigation.hpp"
#include "sim_ins/device/scenario.hpp"
#include "sim_ins/device/stores.hpp"
#include "sim_ins/imu_simulator.hpp"
#include "sim_ins/physics.hpp"

namespace selfcal::sim {

class Instrument {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<Instrument>> create(
      const SimConfig& config, std::uint64_t seed, const ConcealedPhysics& physics, FlashMemory flash,
      const Scenario& scenario, std::size_t samples_per_page = flash::samples_per_page);

  void power_on(double now_s);  // also after a reset: all is lost but what the FLASH had done
  void advance(double now_s);   // everything due up to then happens

  // Self-calibration. Fails with what stands in its way.
  [[nodiscard]] Expected<void> check_schedule(const ins::ScheduleRecord& schedule) const;
  void set_schedule(const ins::ScheduleRecord& schedule) { schedule_ = schedule; }  // a checked one
  const std::optional<ins::ScheduleRecord>& schedule() const { return schedule_; }
  bool busy() const { return state_ == ins::State::rotating || state_ == ins::State::checking; }
  bool ready() const { return state_ != ins::State::starting; }
  [[nodiscard]] Expected<void> start_rotation(std::uint32_t run_id, double now_s);
  // An INS that takes no schedule: its gimbal is told each position by itself, and it records from the start on until it is
  // stopped.
  void turn_by_moves(CommandedGimbal gimbal) { gimbal_.emplace(std::move(gimbal)); }
  // Refused while the gimbal turns, and while the INS checks its navigation.
  [[nodiscard]] Expected<void> move_to(const ins::MoveRecord& position, double now_s);
  void stop_rotation();

  [[nodiscard]] Expected<void> start_navigation_check(const ins::NavigationCheckRequest& request, double now_s);
  void stop_check();
  const ins::NavigationCheckRecord& navigation_check() const { return check_; }

  ins::State state() const { return state_; }
  ins::Status status() const;  // `unlocked` is the server's to fill
  ins::StateRecord state_record() const;
  ins::RunRecord run_record() const;
  ins::SampleFormatRecord sample_format() const;
  const std::string& serial() const { return config_.serial; }
  ins::SiteRecord site() const { return site_; }
  void set_site(const ins::SiteRecord& site) { site_ = site; }

  CoefficientStore& coefficients() { return coefficients_; }
  CounterStore& counters() { return counters_; }
  RawStore& raw() { return raw_; }
  FlashMemory& flash() { return flash_; }

  // The samples since it was asked last, missing ones among them; kept once `keep_stream` was called.
  void keep_stream() { keeps_stream_ = true; }
  std::vector<ImuSample> take_stream() { return std::exchange(stream_, {}); }

  std::optional<double> gimbal_stopped_at_s() const { return stopped_at_s_; }

 private:
  Instrument(const SimConfig& config, std::uint64_t seed, const ConcealedPhysics& physics, FlashMemory flash,
             const Scenario& scenario, std::size_t samples_per_page);

  void take_sample();
  void record_moves(double now_s);
  void keep_sample(const ImuSample& sample);
  void rotate(std::uint32_t run_id, double now_s, std::optional<double> gimbal_noticed_s);
  [[nodiscard]] Expected<void> begin_recording(std::uint32_t run_id, double now_s);
  void flush_page(bool last);
  void finish_rotation(ins::State state);
  void navigate_until(double now_s);
  [[nodiscard]] Expected<std::unique_ptr<ImuSimulator>> make_imu(const Schedule& schedule,
                                                                 const Scenario& scenario) const;

  SimConfig config_;
  std::uint64_t seed_;
  ConcealedPhysics physics_;
  Scenario scenario_;  // of it the faults of gimbal, sensors and pages
  std::size_t samples_per_page_;
  FlashMemory flash_;
  CoefficientStore coefficients_;
  CounterStore counters_;
  RawStore raw_;

  ins::State state_ = ins::State::starting;
  std::uint8_t faults_ = 0;
  double ready_at_s_ = 0.0;
  ins::SiteRecord site_;
  std::optional<ins::ScheduleRecord> schedule_;

  std::unique_ptr<ImuSimulator> imu_;
  std::optional<CommandedGimbal> gimbal_;  // turned move by move
  double now_s_ = 0.0;
  double epoch_s_ = 0.0;  // INS time of the rotation's or check's first sample interval
  std::uint64_t samples_ = 0, samples_wanted_ = 0;
  std::uint32_t run_id_ = 0;
  flash::Page page_;
  ImuSample last_sample_;
  bool keeps_stream_ = false;
  std::vector<ImuSample> stream_;
  std::optional<double> stopped_at_s_;
  std::optional<double> gimbal_noticed_s_;  // when the INS notices that the gimbal goes wrong, in the rotation

  std::unique_ptr<FreeInertialNavigation> navigation_;
  ins::NavigationCheckRecord check_;
};

}  // namespace selfcal::sim
