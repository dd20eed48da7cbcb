// An INS that speaks UDS and streams its samples while it turns (profile::Raw::Way::stream), behind the port of one that keeps them.
// The samples are kept here as pages; their directory, and the memory where they stand, are answered here. All else goes through.
//
// What is kept here ends with it: after a restart of the service a rotation that was under way is lost, and said to be.
#pragma once

#include <memory>
#include <optional>

#include "daemon/host/config.hpp"
#include "daemon/host/event_loop.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/sample_stream.hpp"
#include "protocol/can/socket.hpp"
#include "protocol/ins_interface/records.hpp"

namespace selfcal {

class StreamPort : public InsPort {
 public:
  StreamPort(EventLoop& loop, std::unique_ptr<InsPort> ins, const InsConfig& config);
  ~StreamPort() override;

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override;
  void cancel() override;
  void reopen() override;
  void keep_session(bool keep) override { ins_->keep_session(keep); }
  void take_timings(const uds::SessionTimings& stated) override { ins_->take_timings(stated); }
  std::uint64_t lost_frames() const override;
  std::string_view interface() const override { return config_.interface; }

 private:
  void open();
  void on_readable();
  void drain();
  void begin(std::span<const std::uint8_t> option);
  void watch();

  // The INS's answer to the request in hand, before the service has it.
  Answer<Bytes> seen(Answer<Bytes> answer);
  Answer<Bytes> state_seen(Answer<Bytes> answer);
  bool starts_rotation() const;  // the request in hand
  Answer<Bytes> directory();
  Answer<Bytes> memory(std::span<const std::uint8_t> payload) const;
  void answer(Answer<Bytes> answer);
  std::uint32_t pages_written() const;
  tl::unexpected<PortError> trouble(PortError::Kind kind, const std::string& what) const;

  EventLoop& loop_;
  std::unique_ptr<InsPort> ins_;
  InsConfig config_;
  std::optional<can::Socket> socket_;
  std::unique_ptr<EventLoop::Io> io_;
  std::string trouble_;  // why the socket is not open
  std::uint64_t lost_before_ = 0;
  Timers::Id answer_timer_ = 0, stream_timer_ = 0;

  std::function<void(Answer<Bytes>)> done_;
  Bytes request_;

  SampleStream stream_;
  bool turning_ = false;      // as far as the INS said
  std::uint32_t run_id_ = 0;  // whose samples are kept; 0: none
  std::optional<ins::ScheduleRecord> schedule_;
  double sample_rate_hz_ = 0.0;
  std::uint64_t samples_seen_ = 0;  // when the stream was looked at last
  std::string broken_;              // why the samples of this rotation are of no use
};

}  // namespace selfcal
