// Records in memory: our own INS's profile with addresses in the place of identifiers.
#include <gtest/gtest.h>

#include <string>

#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "tests/unit/sim_ins/diagnostics_fixture.hpp"

namespace selfcal::sim {
namespace {

constexpr std::uint32_t serial_at = 0x1000, state_at = 0x1200, schedule_at = 0x1300, in_force_at = 0x2000,
                        inactive_at = 0x3000, raw_at = 0x800000;
constexpr uds::UploadFormat format{3, 2};

void replace(std::string& text, std::string_view from, std::string_view with) {
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), with);
}

profile::ProfilePtr in_memory() {
  std::string text(profile::built_in_text());
  replace(text, "serial = 0xF18C ", "serial = { memory = 0x1000, bytes = 20 } ");
  replace(text, "did = 0x0200", "memory = 0x1200");
  replace(text, "did = 0x0201\n", "memory = 0x1300\nbytes = 245\n");  // 20 positions
  replace(text, "in_force = 0x0210", "in_force = { memory = 0x2000 }");
  replace(text, "inactive = 0x0211", "inactive = { memory = 0x3000 }");
  const auto begin = text.find("[upload]"), end = text.find("[page]");
  text.replace(
      begin, end - begin,
      "[memory]\naddress = 0x800000\naddress_bytes = 3\nsize_bytes = 2\nlongest = 128\nlongest_write = 100\n\n");
  return profile::parse_profile(text, "in_memory.toml").value();
}

class RecordMemoryTest : public DiagnosticsTest {
 protected:
  RecordMemoryTest() : DiagnosticsTest(in_memory()) {}
  uds::Bytes read(std::uint32_t address, std::uint32_t bytes) {
    return ask(uds::memory_request(address, bytes, format));
  }
  Nrc refusal(std::uint32_t address, std::uint32_t bytes) {
    return nrc_of(uds::memory_request(address, bytes, format));
  }
  Nrc write(std::uint32_t address, const uds::Bytes& data) {
    return nrc_of(uds::write_memory_request(address, data, format));
  }
  static uds::Bytes part(const uds::Bytes& record, std::size_t from, std::size_t to) {
    return {record.begin() + static_cast<std::ptrdiff_t>(from), record.begin() + static_cast<std::ptrdiff_t>(to)};
  }
  uds::Bytes schedule_record() {
    ins::ScheduleRecord schedule;
    schedule.positions = {{0, 0, 20000}, {90000, 0, 20000}};
    schedule.rotation_ms = 5000;
    return profile::encode(*profile_, schedule).value();
  }
};

TEST_F(RecordMemoryTest, ARecordIsToldInTheDefaultSessionByItsBytes) {
  const uds::Bytes whole = read(serial_at, 20);
  ASSERT_EQ(whole.size(), 21U);
  EXPECT_EQ(whole[0], 0x63);
  const std::string serial = small().serial;
  EXPECT_EQ(std::string(whole.begin() + 1, whole.begin() + 1 + static_cast<std::ptrdiff_t>(serial.size())), serial);
  EXPECT_EQ(whole.back(), 0);  // filled up
  const uds::Bytes second = read(serial_at + 1, 2);
  EXPECT_EQ(second, (uds::Bytes{0x63, whole[2], whole[3]}));
  const uds::Bytes state = read(state_at, 19);
  ASSERT_EQ(state.size(), 20U);
  EXPECT_TRUE(profile::decode_state(*profile_, std::span(state).subspan(1)));
  EXPECT_EQ(nrc_of(uds::read_request(did::state)), Nrc::request_out_of_range);  // it has no identifier any more
  EXPECT_EQ(nrc_of(uds::read_request(*profile_->state.did)), Nrc::request_out_of_range);
  EXPECT_EQ(nrc_of(uds::read_request(did::site)), Nrc::none);
}

TEST_F(RecordMemoryTest, WhatIsInNoRecordIsRefused) {
  EXPECT_EQ(refusal(serial_at - 1, 2), Nrc::request_out_of_range);
  EXPECT_EQ(refusal(serial_at + 19, 2), Nrc::request_out_of_range);
  EXPECT_EQ(refusal(serial_at, 0), Nrc::request_out_of_range);
  EXPECT_EQ(refusal(in_force_at, 129), Nrc::request_out_of_range);  // more than is told at once
  EXPECT_EQ(nrc_of({0x23, 0x22, 0x10, 0, 0, 1}), Nrc::request_out_of_range);
  EXPECT_EQ(nrc_of({0x23, 0x23, 0, 0x10, 0, 0}), Nrc::incorrect_message_length);
  EXPECT_EQ(refusal(schedule_at, 2), Nrc::conditions_not_correct);  // none was written
  EXPECT_EQ(refusal(raw_at, 1), Nrc::request_out_of_range);         // raw data are told in a session
}

// ISO 14229-1, 10.8: session, length, format, total length, range, security, then record and conditions.
TEST_F(RecordMemoryTest, AWriteIsRefusedInTheOrderOfTheStandard) {
  const uds::Bytes record = schedule_record();
  EXPECT_EQ(write(schedule_at, part(record, 0, 100)), Nrc::service_not_supported_in_session);
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  EXPECT_EQ(nrc_of({0x3D, 0x23, 0}), Nrc::incorrect_message_length);
  EXPECT_EQ(nrc_of({0x3D, 0x24, 0, 0, 0x13, 0, 0, 1, 7}), Nrc::request_out_of_range);
  uds::Bytes longer = uds::write_memory_request(schedule_at, part(record, 0, 100), format);
  longer.push_back(0);
  EXPECT_EQ(nrc_of(longer), Nrc::incorrect_message_length);
  EXPECT_EQ(write(state_at, {1}), Nrc::request_out_of_range);  // only read
  EXPECT_EQ(write(schedule_at + 200, part(record, 0, 46)), Nrc::request_out_of_range);
  EXPECT_EQ(write(schedule_at, part(record, 0, 101)), Nrc::request_out_of_range);
  EXPECT_EQ(write(schedule_at, part(record, 0, 100)), Nrc::security_access_denied);
  unlock();
  EXPECT_EQ(write(schedule_at, part(record, 0, 100)), Nrc::none);
}

TEST_F(RecordMemoryTest, ARecordIsTakenWithItsLastPart) {
  const uds::Bytes record = schedule_record();
  ASSERT_EQ(record.size(), 245U);
  unlock();
  EXPECT_EQ(write(schedule_at + 100, part(record, 100, 200)), Nrc::conditions_not_correct);  // without the first
  EXPECT_EQ(write(schedule_at, part(record, 0, 100)), Nrc::none);
  EXPECT_EQ(write(schedule_at + 200, part(record, 200, 245)), Nrc::conditions_not_correct);  // one is left out
  EXPECT_EQ(write(schedule_at + 100, part(record, 100, 200)), Nrc::none);
  EXPECT_FALSE(instrument_->schedule());
  EXPECT_EQ(ask(uds::write_memory_request(schedule_at + 200, part(record, 200, 245), format)),
            (uds::Bytes{0x7D, 0x23, 0x00, 0x13, 0xC8, 0x00, 0x2D}));
  ASSERT_TRUE(instrument_->schedule());
  EXPECT_EQ(instrument_->schedule()->positions.size(), 2U);
  const uds::Bytes told = read(schedule_at, 128);
  EXPECT_EQ(part(told, 1, 129), part(record, 0, 128));
  uds::Bytes wrong = record;
  wrong[5] = 0x7F;  // the outer angle of the first position: millions of degrees
  EXPECT_EQ(write(schedule_at, part(wrong, 0, 100)), Nrc::none);
  EXPECT_EQ(write(schedule_at + 100, part(wrong, 100, 200)), Nrc::none);
  EXPECT_EQ(write(schedule_at + 200, part(wrong, 200, 245)), Nrc::request_out_of_range);
  EXPECT_EQ(instrument_->schedule()->rotation_ms, 5000U);  // what it held
}

TEST_F(RecordMemoryTest, APartThatWasBegunEndsWithTheSession) {
  const uds::Bytes record = schedule_record();
  unlock();
  EXPECT_EQ(write(schedule_at, part(record, 0, 100)), Nrc::none);
  unlock();
  EXPECT_EQ(write(schedule_at + 100, part(record, 100, 200)), Nrc::conditions_not_correct);
}

TEST_F(RecordMemoryTest, ASetInTheSlotGoesTheSameWay) {
  unlock();
  ASSERT_EQ(nrc_of(uds::routine_request(uds::RoutineAction::start, routine::erase_inactive)), Nrc::none);
  EXPECT_EQ(refusal(inactive_at, 4), Nrc::conditions_not_correct);  // erased
  const uds::Bytes record = profile::encode(*profile_, set_of(3)).value();
  for (const auto& [from, to] : {std::pair(0, 100), std::pair(100, 200), std::pair(200, 260)}) {
    ASSERT_EQ(write(inactive_at + static_cast<std::uint32_t>(from),
                    part(record, static_cast<std::size_t>(from), static_cast<std::size_t>(to))),
              Nrc::none);
  }
  EXPECT_EQ(instrument_->coefficients().inactive()->version, 3U);
  EXPECT_EQ(write(in_force_at, part(record, 0, 100)), Nrc::request_out_of_range);  // only read
}

// Without slots a coefficient may have an address of its own: it is taken by itself, over the set that is there.
class FieldMemoryTest : public DiagnosticsTest {
 protected:
  FieldMemoryTest()
      : DiagnosticsTest(
            profile::load_profile(SELFCAL_SOURCE_DIR "/tests/fuzz/protocol/corpus/profile/addressed_fields.toml")
                .value()) {}
};

TEST_F(FieldMemoryTest, ACoefficientIsReadAndWrittenByItself) {
  constexpr std::uint32_t bias_at = 0x70000010;  // i32 in 0.001 ug
  constexpr uds::UploadFormat wide{4, 2};
  EXPECT_EQ(ask(uds::memory_request(bias_at, 4, wide)), (uds::Bytes{0x63, 0, 0, 0, 0}));
  ASSERT_EQ(nrc_of({0x10, 0x60}), Nrc::none);  // the profile's session; it has no lock
  const uds::Bytes record{0x00, 0x01, 0x86, 0xA0};
  EXPECT_EQ(nrc_of(uds::write_memory_request(bias_at, record, wide)), Nrc::none);
  EXPECT_EQ(ask(uds::memory_request(bias_at, 4, wide)), (uds::Bytes{0x63, 0x00, 0x01, 0x86, 0xA0}));
  EXPECT_NEAR(instrument_->coefficients().stored().value[0], 100e-6 * 9.80665, 1e-12);
  EXPECT_EQ(nrc_of(uds::write_memory_request(bias_at + 4, record, wide)), Nrc::request_out_of_range);  // between two
}

// Beside them the raw data are told as before.
TEST_F(RecordMemoryTest, RawDataStandInTheSameMemory) {
  unlock();
  const uds::Bytes record = schedule_record();
  ASSERT_EQ(write(schedule_at, part(record, 0, 100)), Nrc::none);
  ASSERT_EQ(write(schedule_at + 100, part(record, 100, 200)), Nrc::none);
  ASSERT_EQ(write(schedule_at + 200, part(record, 200, 245)), Nrc::none);
  ASSERT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::none);
  run_for(6.5);  // 325 samples, 2 pages of 145
  EXPECT_EQ(part(read(raw_at, 4), 0, 5), (uds::Bytes{0x63, 'S', 'C', 'R', 'P'}));
  EXPECT_EQ(refusal(raw_at + 2 * 4096, 1), Nrc::request_out_of_range);
}

// And the other way round: our own INS has no memory to read or to write.
TEST_F(DiagnosticsTest, HasNoRecordsInMemory) {
  unlock();
  EXPECT_EQ(nrc_of(uds::memory_request(serial_at, 1, format)), Nrc::service_not_supported);
  EXPECT_EQ(nrc_of(uds::write_memory_request(serial_at, uds::Bytes{1}, format)), Nrc::service_not_supported);
}

}  // namespace
}  // namespace selfcal::sim
