// The INS's side of ISO 14229: sessions, the lock, identifiers, routines, upload.
//
// A request is checked in the order of ISO 14229-1, figures 5 to 7, and then in that of its service: service known, in
// this session, length, sub-function, then what the service itself asks of identifier, security, record, sequence and
// conditions. README.md holds the table.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "protocol/profile/profile.hpp"
#include "protocol/uds/messages.hpp"
#include "protocol/uds/security.hpp"
#include "protocol/uds/server.hpp"
#include "sim_ins/device/instrument.hpp"
#include "sim_ins/device/raw_upload.hpp"
#include "sim_ins/device/security_lock.hpp"

namespace selfcal::sim {

struct DiagnosticOptions {
  profile::ProfilePtr profile = profile::built_in();
  uds::SecurityKey key{};
  std::uint32_t longest_response = 4095;  // of TransferData, bytes
  std::uint64_t seed_salt = 0;            // 0: seeds from the system's entropy; else reproducible (tests)
};

class Diagnostics : public uds::RequestHandler {
 public:
  Diagnostics(Instrument& instrument, const DiagnosticOptions& options);

  // `later` where the request writes to the FLASH: take_answer() has the answer once that is done.
  Answer handle(std::span<const std::uint8_t> request, uds::Bytes& response, Time now) override;
  std::optional<uds::Bytes> take_answer();
  void session_expired(Time now) override;

  void power_on(Time now);                                               // default session, locked
  void answer_all_with(std::optional<uds::Nrc> nrc) { refusal_ = nrc; }  // fault on demand
  void set_instrument_time(double now_s) { now_s_ = now_s; }
  bool unlocked() const { return profile_->security.needed ? lock_.open() : session_ != uds::Session::standard; }
  uds::Session session() const { return session_; }
  bool session_timer_wanted() const { return session_ != uds::Session::standard; }
  bool take_reset_request() { return std::exchange(reset_wanted_, false); }
  // Pages of which the tester has had every byte; and whether an upload is under way.
  std::uint32_t pages_served() const { return upload_.pages_served(); }
  bool uploading() const { return upload_.active(); }

 private:
  using View = std::span<const std::uint8_t>;
  using Reply = uds::Reply;

  Reply dispatch(View request, Time now, uds::Bytes& response);
  bool profile_has(std::uint8_t id) const;
  uds::Nrc general_objection(View request) const;
  Reply session_control(View request);
  Reply ecu_reset(View request);
  Reply security_access(View request, Time now);
  Reply read_data(View request);
  bool knows(std::uint16_t did) const;
  std::optional<uds::Bytes> record(std::uint16_t id);
  Reply write_data(View request);
  bool takes(std::uint16_t id) const;
  Reply write_record(std::uint16_t id, View record);
  Reply read_memory(View request);
  Reply write_memory(View request);
  Reply write_schedule(View record);
  Reply move(View record);
  Reply write_site(View record);
  Reply write_coefficients(View record);
  Reply write_over_set(std::uint16_t id, View record);
  Reply routine(View request);
  Reply start_routine(const uds::RoutineCall& call);
  Reply start_calibration(const uds::RoutineCall& call);
  Reply commit(const uds::RoutineCall& call);
  Reply start_check(const uds::RoutineCall& call);
  Reply routine_result(const uds::RoutineCall& call);
  void enter(uds::Session session);

  Instrument& instrument_;
  profile::ProfilePtr profile_;
  double now_s_ = 0.0;
  uds::Session session_ = uds::Session::standard;
  SecurityLock lock_;
  RawUpload upload_;
  bool reset_wanted_ = false;
  bool calibration_started_ = false, check_started_ = false;  // since power-on
  std::optional<uds::Nrc> refusal_;

  struct Waiting {
    uds::Bytes response;
    double due_s = 0.0;  // INS time
  };
  std::optional<Waiting> answer_;

  // A record in memory of which not all parts were written: it is taken with the last one.
  struct Begun {
    std::uint16_t id = 0;
    uds::Bytes record;
  };
  std::optional<Begun> begun_;
};

}  // namespace selfcal::sim
