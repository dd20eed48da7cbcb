// The INS on a CAN interface as one that speaks no UDS (protocol/profile/frames.hpp): commands and signals in plain frames, moves one by
// one, samples streamed while it turns.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/can/bus_load.hpp"
#include "protocol/can/socket.hpp"
#include "sim_ins/device/bus_node.hpp"
#include "sim_ins/device/commanded_gimbal.hpp"
#include "sim_ins/device/diagnostics.hpp"
#include "sim_ins/device/instrument.hpp"
#include "sim_ins/device/scenario.hpp"

namespace selfcal::sim {

class FrameNode {
 public:
  // Of the options, those of UDS have no meaning.
  [[nodiscard]] static Expected<std::unique_ptr<FrameNode>> open(const NodeOptions& options, Instrument& instrument,
                                                                 CommandedGimbal gimbal);
  // Runs until `stop` is set by a signal handler.
  void run(const volatile int& stop);

 private:
  using Values = std::span<const std::pair<std::string_view, double>>;
  FrameNode(const NodeOptions& options, Instrument& instrument, CommandedGimbal gimbal, can::Socket socket);

  void reset(Time now);
  void advance_clock(Time now);
  void receive(Time now);
  void take(const can::CanFrame& frame, Time now);
  void move(const can::CanFrame& frame);
  // To the store of coefficients, which answers as it answers over UDS.
  void ask_store(std::uint16_t did, std::span<const std::uint8_t> record, Time now);
  void tell_coefficient(std::span<const std::uint8_t> answer);
  void tell_state();
  void tell_sample(const ImuSample& sample);
  void send(can::CanFrame frame);
  bool acts(FaultKind kind) const { return options_.scenario.active(kind, now_s_) != nullptr; }
  const profile::Profile& profile() const { return *options_.diagnostics.profile; }
  const profile::Frames& frames() const { return *profile().frames; }
  Time ins_time() const;

  NodeOptions options_;
  Instrument& instrument_;
  CommandedGimbal gimbal_;
  Diagnostics store_;
  can::Socket socket_;
  can::BusClock bus_;
  FaultyBus faulty_;
  std::vector<can::CanFrame> out_;  // kept for its storage
  std::uint16_t asked_did_ = 0;
  double now_s_ = 0.0;
  Time real_before_{0};
  double next_status_s_ = 0.0;
  std::uint64_t counter_ = 0;
};

}  // namespace selfcal::sim
