// The INS on a CAN interface: drives the clock, paces its frames by their bit time, answers requests, tells its status.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/can/bus_load.hpp"
#include "protocol/can/socket.hpp"
#include "protocol/uds/server.hpp"
#include "sim_ins/device/diagnostics.hpp"
#include "sim_ins/device/instrument.hpp"
#include "sim_ins/device/scenario.hpp"
#include "sim_ins/device/turnaround.hpp"

namespace selfcal::sim {

struct NodeOptions {
  std::string interface = "vcan0";
  std::uint32_t request_id = 0;
  std::uint32_t response_id = 0;
  std::uint32_t functional_id = 0;
  std::uint32_t status_id = 0;  // and status_id + 1
  bool tells_status = true;
  bool extended_ids = false;
  bool fd = false;
  can::BitRates rates;
  double speed = 1.0;          // INS seconds per second
  double turnaround_ms = 0.0;  // INS time from an answer to the tester's next request, in an upload
  double patience = 1.0;       // stretches N_As, N_Bs, N_Cr and S3, which run in real time
  Scenario scenario;           // faults of the bus, of status and answers, by time
  DiagnosticOptions diagnostics;
};

class BusNode {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<BusNode>> open(const NodeOptions& options, Instrument& instrument);

  // Runs until `stop` is set by a signal handler.
  void run(const volatile int& stop);

 private:
  BusNode(const NodeOptions& options, Instrument& instrument, can::Socket socket);

  void reset(Time now);
  void note_state();
  void reset_on_demand(Time now);
  void receive(Time now);
  void lose_link(const Error& why);
  void try_reopen(Time now);
  double longest_step() const;
  void advance_clock(Time now);
  void transmit(Time now);
  bool put_on_bus(std::span<const can::CanFrame> frames);
  bool send_all(std::span<const can::CanFrame> frames);
  bool acts(FaultKind kind) const { return options_.scenario.active(kind, now_s_) != nullptr; }
  void hear_second_tester(Time now);
  void queue_status();
  void tell_progress();
  int sleep_ms() const;
  bool transaction() const { return diagnostics_.uploading(); }
  Time ins_time() const;

  NodeOptions options_;
  Instrument& instrument_;
  Diagnostics diagnostics_;
  uds::Server server_;
  can::SocketOptions socket_options_;
  std::optional<can::Socket> socket_;
  can::BusClock bus_;
  Turnaround turnaround_;
  FaultyBus faulty_;
  std::vector<can::CanFrame> spoilt_;  // kept for its storage
  double next_intrusion_s_ = 0.0;

  double now_s_ = 0.0;  // INS time
  Time step_began_{0};  // INS time before its last step
  Time real_before_{0};
  Time tester_heard_{0};  // real time of its last frame
  Time retry_at_{0};
  bool more_to_send_ = false;
  double next_status_s_ = 0.0;
  std::uint8_t alive_ = 0;
  std::vector<can::CanFrame> status_frames_, stream_frames_;
  std::uint64_t stream_counter_ = 0;
  bool stop_told_ = true, upload_told_ = true;
  bool reset_pending_ = false;
};

}  // namespace selfcal::sim
