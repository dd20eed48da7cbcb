// One INS on a CAN interface: the UDS client and a CAN_RAW socket on the daemon's loop.
#pragma once

#include <memory>
#include <optional>

#include "daemon/host/config.hpp"
#include "daemon/host/event_loop.hpp"
#include "daemon/ins/bus_listener.hpp"
#include "daemon/ins/ins_port.hpp"
#include "protocol/can/socket.hpp"
#include "protocol/uds/client.hpp"

namespace selfcal {

class CanPort : public InsPort {
 public:
  CanPort(EventLoop& loop, const InsConfig& config);
  ~CanPort() override;

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override;
  void cancel() override;
  void reopen() override;
  void keep_session(bool keep) override;
  void take_timings(const uds::SessionTimings& stated) override;
  std::uint64_t lost_frames() const override;
  std::string_view interface() const override { return config_.interface; }

 private:
  void open();
  void down(const Error& error);
  void on_readable();
  bool receive_batch();
  void take_status(const can::CanFrame& frame, bool& news);
  void pump();
  void schedule();
  void on_deadline();
  void deliver(const uds::Outcome& outcome);
  void answer(Answer<Bytes> answer);
  PortError explain(const uds::Outcome& outcome);
  std::string no_answer(const uds::Outcome& outcome);
  PortError link_error(const std::string& what) const;

  EventLoop& loop_;
  InsConfig config_;
  uds::Client client_;
  std::optional<can::Socket> socket_;
  std::optional<BusListener> listener_;  // while requests go unanswered
  std::unique_ptr<EventLoop::Io> io_;
  Timers::Id timer_ = 0;
  Timers::Id answer_timer_ = 0;
  std::function<void(Answer<Bytes>)> done_;
  std::uint8_t service_ = 0;
  std::size_t longest_answer_ = 0;
  ins::Status status_;
  std::string trouble_;            // why the socket is not open
  std::uint64_t lost_before_ = 0;  // by sockets of the past
  bool receiving_ = false;
  bool reopen_wanted_ = false;
  bool small_buffer_said_ = false;
};

}  // namespace selfcal
