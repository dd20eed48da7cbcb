// The INS's side of ISO 14229: sessions, the lock, identifiers, routines, upload.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "protocol/uds/messages.hpp"
#include "protocol/uds/security.hpp"
#include "protocol/uds/server.hpp"
#include "sim_ins/device/instrument.hpp"

namespace selfcal::sim {

struct DiagnosticOptions {
  uds::SecurityKey key{};
  std::uint32_t longest_response = 4095;    // of TransferData, bytes
  std::optional<uds::Nrc> answer_all_with;  // fault on demand: every request is refused so
  std::uint64_t seed_salt = 0;              // 0: seeds from the system's entropy; else reproducible (tests)
};

class Diagnostics : public uds::RequestHandler {
 public:
  Diagnostics(Instrument& instrument, const DiagnosticOptions& options);

  // `later` where the request writes to the FLASH: take_answer() has the answer once that is done.
  Answer handle(std::span<const std::uint8_t> request, uds::Bytes& response, Time now) override;
  std::optional<uds::Bytes> take_answer();
  void session_expired(Time now) override;

  void power_on(Time now);  // default session, locked
  void answer_all_with(std::optional<uds::Nrc> nrc) { options_.answer_all_with = nrc; }
  void set_instrument_time(double now_s) { now_s_ = now_s; }
  bool unlocked() const { return unlocked_; }
  bool session_timer_wanted() const { return session_ != uds::Session::standard; }
  bool take_reset_request() { return std::exchange(reset_wanted_, false); }
  // Pages of which the tester has had every byte; and whether an upload is under way.
  std::uint32_t pages_served() const { return pages_served_; }
  bool uploading() const { return upload_.has_value(); }

 private:
  using View = std::span<const std::uint8_t>;
  using Reply = tl::expected<uds::Bytes, uds::Nrc>;

  Reply dispatch(View request, Time now, uds::Bytes& response);
  Reply session_control(View request);
  Reply ecu_reset(View request);
  Reply security_access(View request, Time now);
  Reply give_seed(Time now);
  Reply take_key(View key, Time now);
  Reply read_data(View request);
  Reply write_data(View request);
  Reply routine(View request);
  Reply start_routine(const uds::RoutineCall& call);
  Reply request_upload(View request);
  Reply transfer(View request, uds::Bytes& response);
  bool may_change() const { return unlocked_ && session_ != uds::Session::standard; }
  uds::Nrc why_not_change() const;

  Instrument& instrument_;
  DiagnosticOptions options_;
  double now_s_ = 0.0;
  uds::Session session_ = uds::Session::standard;
  bool unlocked_ = false;
  bool reset_wanted_ = false;
  std::optional<std::array<std::uint8_t, uds::seed_bytes>> seed_;  // given out, not yet answered: used once
  std::uint64_t seeds_given_ = 0;
  Time locked_until_{0};

  struct Waiting {
    uds::Bytes response;
    double due_s = 0.0;  // INS time
  };
  std::optional<Waiting> answer_;

  struct Upload {
    std::uint32_t first_page = 0, bytes = 0;
    std::uint32_t done = 0;  // bytes handed over
    std::uint8_t next_block = 1;
    std::uint32_t last_size = 0;  // of the block before, should it be asked for again
  };
  std::optional<Upload> upload_;
  std::uint32_t pages_served_ = 0;
};

}  // namespace selfcal::sim
