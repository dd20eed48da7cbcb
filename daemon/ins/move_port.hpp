// An INS that speaks UDS and takes no schedule (profile::Move), behind the port of one that does. The port keeps the schedule that
// the service writes, commands its positions one by one by requests of its own, between those of the service, and says of state,
// directory and result of the rotation what an INS with a schedule would say (profile::told_as). All else goes through as it is.
//
// What is kept here ends with the port: after a restart of the service a rotation that was under way is lost. It is stopped once
// the service has its session again.
#pragma once

#include <memory>
#include <optional>

#include "daemon/host/config.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/move_sequence.hpp"

namespace selfcal {

class MovePort : public InsPort {
 public:
  MovePort(Timers& timers, std::shared_ptr<InsPort> ins, const InsConfig& config);
  ~MovePort() override;

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override;
  void cancel() override;
  void reopen() override { ins_->reopen(); }
  void keep_session(bool keep) override { ins_->keep_session(keep); }
  void take_timings(const uds::SessionTimings& stated) override { ins_->take_timings(stated); }
  std::uint64_t lost_frames() const override { return ins_->lost_frames(); }
  std::string_view interface() const override { return ins_->interface(); }

 private:
  // Requests of our own: a move, the start and the end of the recording, the end of one that is lost, and the state.
  enum class Own : std::uint8_t { nothing, move, start, end, stop_lost, look };
  using Phase = MoveSequence::Phase;

  // The service's request.
  bool keeps(std::span<const std::uint8_t> payload);
  void keep_schedule(std::span<const std::uint8_t> record);
  void begin_rotation();
  void pass_on();
  void take_answer(Answer<Bytes> answer);
  void answer(Answer<Bytes> answer);
  void answer_later(Answer<Bytes> answer);
  Answer<Bytes> as_told(Answer<Bytes> answer);
  Answer<Bytes> state_as_told(ins::StateRecord state);
  Answer<Bytes> directory_as_told(const Bytes& response);
  Answer<Bytes> result_as_told(const Bytes& response) const;

  // Our own.
  void next();
  void send(Own what);
  Bytes payload_of(Own what) const;
  Expected<void> fault_of(Own what, const Bytes& response) const;
  void take_own(Own what, const Answer<Bytes>& answer);
  void take_look(const Answer<Bytes>& answer);
  void not_done(Own what, const PortError& error);
  void try_again(std::chrono::nanoseconds after);
  void watch();

  // The rotation.
  Expected<ins::StateRecord> state_in(const Bytes& response) const;
  void observe(const ins::StateRecord& state);
  void follow(const ins::StateRecord& state);
  void take_phase(Phase before);
  void tell_status(const ins::StateRecord& state);
  ins::State as_rotation(ins::State told) const;
  bool lost(const ins::StateRecord& state) const;
  void break_off(std::string why, std::optional<PortError> error = std::nullopt);
  PortError trouble(const std::string& what) const;
  std::string words_of(const PortError& error) const;
  bool turning() const { return sequence_.active() || sequence_.phase() == Phase::approaching; }
  bool waits() const { return sequence_.phase() == Phase::approaching || sequence_.phase() == Phase::moving; }
  double now_s() const;  // of the INS's clock
  const profile::Move& move() const { return *config_.profile->move; }

  Timers& timers_;
  std::shared_ptr<InsPort> ins_;
  InsConfig config_;
  profile::ProfilePtr told_;  // by which the service reads
  Timers::Id answer_timer_ = 0, watch_timer_ = 0, again_timer_ = 0;

  std::function<void(Answer<Bytes>)> done_;  // of the service's request
  Bytes request_;
  std::size_t longest_answer_ = 0;
  bool pending_ = false;    // it waits for one of ours
  bool passed_on_ = false;  // it is with the INS
  Own own_ = Own::nothing;  // with the INS
  Own wanted_ = Own::nothing;
  bool look_due_ = false;
  int busy_ = 0;           // times in a row that the INS asked to be asked again
  std::string not_taken_;  // why the last command was not taken

  MoveSequence sequence_;
  std::optional<ins::ScheduleRecord> schedule_;
  Bytes start_;                // the service's request, until it is answered
  bool session_open_ = false;  // by the service, through this port
  bool recording_ = false;     // the INS was started
  bool ended_ = false;         // and ended behind the last dwell
  bool stopped_ = false;       // before that
  bool moved_ = false;         // a move was commanded, and rest was not seen since
  std::string unsaid_;         // why the rotation broke off, until somebody asks
  std::uint32_t pages_written_ = 0;
  std::pair<std::size_t, bool> shown_{};  // position, and whether the gimbal moves
};

}  // namespace selfcal
