// An INS behind an InsPort, without a bus: answers requests after a millisecond of simulated time, turns its gimbal,
// writes pages, keeps its slots, and fails in the ways that a test asks for.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "tests/unit/daemon/simulated_timers.hpp"

namespace selfcal::testing_support {

class FakeIns : public InsPort {
 public:
  explicit FakeIns(Timers& timers);
  ~FakeIns() override;

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override;
  void cancel() override;
  void reopen() override {}
  std::uint64_t lost_frames() const override { return 0; }
  std::string_view interface() const override { return "fake0"; }
  void keep_session(bool keep) override;
  void take_timings(const uds::SessionTimings& stated) override { timings_taken = stated; }

  void power_cycle();  // RAM is lost; the newest valid slot comes into force
  ins::State state();
  std::uint32_t pages_written();
  std::uint8_t position();  // 1 is the first; 0: it does not turn
  const ins::Coefficients& in_force() const { return slots_.at(in_force_); }
  // Five seconds (S3) after the last request or TesterPresent the session is over and the INS is locked.
  bool in_default_session() const { return !extended_ || session_expired(); }
  bool unlocked() const { return unlocked_ && !in_default_session(); }
  bool session_kept() const { return session_kept_; }

  // Faults
  bool dead = false;                       // no answer to anything
  std::optional<std::uint8_t> refuse;      // every request with this NRC
  std::map<std::uint32_t, int> bad_pages;  // page: so many readings with a wrong CRC
  bool loses_writes = false;               // what is written is not what is read back
  bool ignores_commit = false;
  std::uint32_t ring = pages;                      // so many of the newest pages are kept
  bool gimbal_sticks = false;                      // the rotation fails half-way
  std::optional<std::uint8_t> refuses_check_stop;  // with this NRC

  // Somebody in the middle: sees each request and the INS's answer, and may change the answer.
  std::function<void(std::span<const std::uint8_t> request, Answer<Bytes>& answer)> alter;
  // Requests that are never answered; everything else is.
  std::function<bool(std::span<const std::uint8_t> request)> ignores;
  std::chrono::nanoseconds given_up_after = std::chrono::seconds(1);  // by the port, upon such a request
  bool erases = true;                                                 // else it agrees, and does nothing
  std::uint32_t block_bytes = flash::page_bytes;                      // of data in a TransferData

  void begin_check() { check_started_ = timers_.now(); }  // as another tester would

  // Sends status frames, whose clock runs `schedule_s` in a rotation; standing but for `moving` of each second.
  void send_status(double schedule_s);
  bool moving = false;

  UnlockKey key{1, 2, 3};
  std::string serial = "FAKE-1";
  static constexpr std::uint32_t pages = 20;
  static constexpr double rotation_s = 100.0;
  static constexpr double check_s = 30.0;
  double sample_rate_hz = pages * flash::samples_per_page / rotation_s;
  std::optional<double> told_rate_hz;  // else that one

  int starts = 0;         // rotations commanded
  int second_starts = 0;  // of them, on top of one that was not over
  int stops = 0;
  int check_stops = 0;
  std::vector<std::uint32_t> pages_read;
  std::optional<uds::SessionTimings> timings_taken;

 private:
  bool session_expired() const;
  Answer<Bytes> change_session(std::uint8_t wanted);
  Answer<Bytes> respond(std::span<const std::uint8_t> request);
  Answer<Bytes> respond_to_routine(std::span<const std::uint8_t> request);
  Answer<Bytes> read(std::uint16_t did);
  tl::unexpected<PortError> no(std::uint8_t nrc);
  Bytes page(std::uint32_t number);
  Bytes next_block();
  double since_start() const;
  double check_elapsed() const;

  Timers& timers_;
  Timers::Id timer_ = 0;
  bool unlocked_ = false;
  bool extended_ = false;
  bool session_kept_ = false;  // by TesterPresent
  SteadyTime alive_at_{};      // the last request, or the end of TesterPresent
  std::array<std::uint8_t, 16> seed_{9, 9, 9};
  ins::State resting_ = ins::State::idle;
  bool turning_ = false;
  ins::ScheduleRecord schedule_;
  SteadyTime started_{};
  std::uint32_t rotation_ = 0;
  std::uint32_t power_cycles_ = 1;
  std::array<ins::Coefficients, 2> slots_;
  std::size_t in_force_ = 0;
  Bytes inactive_;  // as written, not committed yet; in FLASH
  std::optional<SteadyTime> check_started_;
  std::uint32_t upload_page_ = 0;
  Bytes upload_rest_;  // of the page that is being uploaded
  Timers::Id status_timer_ = 0;
  double schedule_s_ = 0.0;
  double stopped_s_ = -1.0;  // into the rotation
};

}  // namespace selfcal::testing_support
