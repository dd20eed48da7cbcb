// Faults on demand, from a scenario file: what goes wrong, when, and how.
//
//   seed = 1
//   [[fault]]
//   kind = "drop"           # names in scenario.cpp
//   at_s = 10.0             # INS time, for for_s seconds
//   state = "rotating"      # at_s counts from when the INS first gets into this state
//   probability = 0.01
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/error.hpp"
#include "protocol/ins_interface/status.hpp"
#include "sim_ins/gimbal.hpp"
#include "sim_ins/imu_simulator.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::sim {

enum class FaultKind : std::uint8_t {
  drop,
  duplicate,
  reorder,
  corrupt,
  delay,    // frames the INS sends: each with `probability`
  bus_off,  // neither sends nor hears
  babble,   // a node floods the bus with `value` frames a second
  reset,    // the INS restarts at `at_s`
  stuck_gimbal,
  overshoot,
  wrong_direction,  // move number `value` (1 first); overshoot by `amount` degrees. stuck with value 0: from `at_s` on no
                    // move begins
  saturated_gyro,
  saturated_accel,
  frozen_gyro,
  frozen_accel,  // axis `value`; saturated at `amount` counts
  late_status,
  wrong_status,   // no status frames; state says idle
  second_tester,  // somebody else asks for the serial number, `value` times a second
  nrc,            // every request is answered with NRC `value`
  spoilt_page,    // raw page `value` is read out wrong `amount` times (once, if 0)
};

inline constexpr std::size_t fault_kinds = 20;

struct Fault {
  FaultKind kind = FaultKind::drop;
  double at_s = 0.0;                // from here, INS time: since the rotation began (sensors), else since power-on,
  std::optional<ins::State> state;  // or since the INS first got into this state
  double for_s = 1e12;              // for so long
  double probability = 1.0;
  double value = 0.0;
  double amount = 0.0;
  bool detected = true;  // gimbal faults: the INS notices and fails
};

struct Scenario {
  std::uint64_t seed = 1;
  std::vector<Fault> faults;

  // The INS is in `state` at t: what waits for that begins to count.
  void note_state(ins::State state, double t);
  // The first fault of the kind that acts at t.
  const Fault* active(FaultKind kind, double t) const;
};

// seed = 1, and [[fault]] kind = "drop", at_s = ..., ...; errors name file, line and key.
[[nodiscard]] Expected<Scenario> read_scenario(const std::string& path);
// The moves as the faulty gimbal makes them.
GimbalMotion spoil_gimbal(const Scenario& scenario, const GimbalMotion& planned);
// When the INS notices that a move went wrong: INS time since the rotation began.
std::optional<double> gimbal_failure_time(const Scenario& scenario, const Schedule& schedule);
// Saturation and freezing of counts; true where a sensor saturated, which the INS notices. That one is frozen it does
// not.
bool spoil_sample(const Scenario& scenario, double t, const ImuSample& before, ImuSample& sample);

// Frames on their way to the bus.
class FaultyBus {
 public:
  explicit FaultyBus(Scenario scenario) : scenario_(std::move(scenario)), random_(scenario_.seed, 21) {}
  // Appends to `out` what of the frame, and of those held back, leaves now.
  void pass(const can::CanFrame& frame, double t, std::vector<can::CanFrame>& out);
  // Delayed frames that are due, and babble.
  void flush(double t, std::vector<can::CanFrame>& out);
  void note_state(ins::State state, double t) { scenario_.note_state(state, t); }
  bool holds_frames() const { return !held_.empty(); }
  const Scenario& scenario() const { return scenario_; }
  // How often each fault acted: "drop 12, reorder 3"; empty if none did.
  std::string tally() const;
  void count(FaultKind kind) { ++acted_[static_cast<std::size_t>(kind)]; }

 private:
  struct Held {
    double until = 0.0;
    can::CanFrame frame;
  };
  bool hits(FaultKind kind, double t, const Fault** fault = nullptr);

  Scenario scenario_;
  Random random_;
  std::deque<Held> held_;
  std::optional<can::CanFrame> overtaken_;
  double babbled_until_ = 0.0;
  std::array<std::uint64_t, fault_kinds> acted_{};
};

}  // namespace selfcal::sim
