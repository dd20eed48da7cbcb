// An INS that speaks no UDS (profile::Frames), behind the port of one that does: the service asks as it asks our own INS, and
// this answers from the INS's frames. What such an INS does not do itself is done here: the schedule is turned move by move, the
// samples that it streams are kept as pages.
//
// What is kept here ends with it: after a restart of the service a rotation that was under way is lost, and said to be.
#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "daemon/host/config.hpp"
#include "daemon/host/event_loop.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/move_sequence.hpp"
#include "daemon/ins/sample_stream.hpp"
#include "protocol/can/socket.hpp"

namespace selfcal {

class FramePort : public InsPort {
 public:
  FramePort(EventLoop& loop, const InsConfig& config);
  ~FramePort() override;

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override;
  void cancel() override;
  void reopen() override;
  void keep_session(bool) override {}
  void take_timings(const uds::SessionTimings&) override {}
  std::uint64_t lost_frames() const override { return lost_before_ + (socket_ ? socket_->lost_frames() : 0); }
  std::string_view interface() const override { return config_.interface; }

 private:
  // What a request waits for.
  enum class Wait : std::uint8_t { nothing, serial, software, state, told, first_position };

  void open();
  void down(const Error& error);
  void on_readable();
  void take(const can::CanFrame& frame);
  void take_state(const can::CanFrame& frame);
  void tell_status(profile::FrameState told, const can::CanFrame& frame) const;
  void take_told(const can::CanFrame& frame);
  void take_identity(const can::CanFrame& frame);

  void serve(std::span<const std::uint8_t> payload);
  void read(std::uint16_t did);
  void write(std::uint16_t did, std::span<const std::uint8_t> record);
  void routine(std::span<const std::uint8_t> payload);
  void read_memory(std::span<const std::uint8_t> payload);
  void start_rotation(std::span<const std::uint8_t> option);
  Bytes state_record(profile::FrameState told, const can::CanFrame& frame) const;
  ins::State run_state(profile::FrameState told) const;
  std::uint32_t pages_written() const;
  double stream_s() const;
  bool turning() const { return sequence_.active() || sequence_.phase() == MoveSequence::Phase::approaching; }

  void command(const profile::Frame& frame, std::initializer_list<std::pair<std::string_view, std::uint64_t>> raw = {});
  void command_move();
  void after_sample();
  void end_stream();
  void break_off(std::string why);
  void watch_stream();
  void pump();

  void wait_for(Wait what, std::string name, double seconds);
  void positive(Bytes tail);  // the answer to the request in hand
  void refuse(uds::Nrc nrc);
  void answer(Answer<Bytes> answer);
  void answer_link(const std::string& why);
  PortError trouble(PortError::Kind kind, const std::string& what) const;
  const profile::Frames& frames() const { return *config_.profile->frames; }

  EventLoop& loop_;
  InsConfig config_;
  std::optional<can::Socket> socket_;
  std::unique_ptr<EventLoop::Io> io_;
  std::string trouble_;  // why the socket is not open
  std::uint64_t lost_before_ = 0;
  std::deque<can::CanFrame> outgoing_;
  Timers::Id send_timer_ = 0, wait_timer_ = 0, answer_timer_ = 0, stream_timer_ = 0;

  std::function<void(Answer<Bytes>)> done_;
  Bytes request_;
  Wait wait_ = Wait::nothing;

  SampleStream stream_;
  MoveSequence sequence_;
  std::optional<ins::ScheduleRecord> schedule_;  // the INS's words
  Bytes schedule_bytes_;
  std::uint32_t run_id_ = 0, pages_expected_ = 0;
  std::uint64_t samples_seen_ = 0;  // when the stream was looked at last
  bool stopped_ = false;            // before its end
  std::string unsaid_;              // why a rotation broke off, until somebody asks
};

}  // namespace selfcal
