// The INS's diagnostics without a bus, on a clock of its own: requests and answers as bytes.
#pragma once

#include <gmock/gmock.h>

#include <memory>
#include <optional>

#include "protocol/byte_order.hpp"
#include "sim_ins/device/diagnostics.hpp"
#include "sim_ins/simulate.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"

namespace selfcal::sim {

using uds::Nrc;
namespace did = ins::did;
namespace routine = ins::routine;

inline constexpr uds::SecurityKey right_key{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

inline SimConfig small() {
  SimConfig config;
  config.sample_rate_hz = 50.0;
  return config;
}

class DiagnosticsTest : public testing::Test {
 protected:
  explicit DiagnosticsTest(profile::ProfilePtr profile = profile::built_in()) : profile_(std::move(profile)) {
    switch_on_another();
  }

  // Fresh from the works.
  void switch_on_another() {
    auto flash = FlashMemory::open("", flash_bytes);
    auto created = Instrument::create(small(), 1, {}, std::move(*flash), {});
    instrument_ = std::move(*created);
    DiagnosticOptions options;
    options.key = right_key;
    options.seed_salt = 99;
    options.profile = profile_;
    diagnostics_ = std::make_unique<Diagnostics>(*instrument_, options);
    power_cycle();
  }

  void power_cycle() {
    instrument_->power_on(now_s_);
    diagnostics_->power_on(time());
    run_for(2.0);
  }
  Time time() const { return std::chrono::duration_cast<Time>(std::chrono::duration<double>(now_s_)); }
  void run_for(double seconds) {
    for (const double end = now_s_ + seconds; now_s_ < end;) {
      now_s_ = std::min(end, now_s_ + 1.0);
      diagnostics_->set_instrument_time(now_s_);
      instrument_->advance(now_s_);
    }
  }
  uds::Bytes ask(const uds::Bytes& request) {
    uds::Bytes response;
    if (diagnostics_->handle(request, response, time()) == uds::RequestHandler::Answer::now) {
      EXPECT_FALSE(diagnostics_->take_answer());
      return response;
    }
    const double limit_s = now_s_ + 1.0;
    std::optional<uds::Bytes> answer;
    while (!(answer = diagnostics_->take_answer()) && now_s_ < limit_s) {
      run_for(0.0001);
    }
    EXPECT_TRUE(answer) << "no answer within a second";
    return answer.value_or(uds::Bytes{});
  }
  Nrc nrc_of(const uds::Bytes& request) {
    const uds::Bytes response = ask(request);
    return response.size() == 3 && response[0] == 0x7F ? static_cast<Nrc>(response[2]) : Nrc::none;
  }
  uds::Bytes seed() {
    const uds::Bytes response = ask(uds::seed_request());
    return response.size() == 18 ? uds::Bytes(response.begin() + 2, response.end()) : uds::Bytes{};
  }
  uds::Bytes key_for(const uds::Bytes& seed_given) {
    const auto key = uds::answer_seed(right_key, seed_given);
    return uds::key_request(*key);
  }
  void unlock() {
    ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
    ASSERT_EQ(nrc_of(key_for(seed())), Nrc::none);
    ASSERT_TRUE(diagnostics_->unlocked());
  }
  uds::Bytes start(std::uint16_t id, std::uint32_t word) {
    uds::Bytes option(4);
    ByteWriter(option).put(word);
    return uds::routine_request(uds::RoutineAction::start, id, option);
  }
  uds::Bytes schedule(std::uint32_t dwell_ms) {
    ins::ScheduleRecord record;
    record.positions = {{0, 0, dwell_ms}, {90000, 0, dwell_ms}};
    record.rotation_ms = 5000;
    return uds::write_request(did::schedule, ins::encode(record));
  }
  ins::Coefficients set_of(std::uint32_t version) {
    ins::Coefficients set;
    set.version = version;
    set.author = "test";
    set.value[3] = 1e-8 * version;
    return set;
  }

  static ins::Coefficients factory() {
    ins::Coefficients set;
    set.author = "factory";
    return set;
  }

  profile::ProfilePtr profile_;
  double now_s_ = 0.0;
  std::unique_ptr<Instrument> instrument_;
  std::unique_ptr<Diagnostics> diagnostics_;
};

}  // namespace selfcal::sim
