#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/profile/dbc_file.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"
#include "tests/own_ins/status_frames.hpp"
#include "tests/unit/protocol/frames.hpp"

namespace selfcal::ins {
namespace {

using testing::HasSubstr;

Coefficients sample_coefficients() {
  Coefficients c;
  c.version = 4;
  c.date_s = 1'700'000'000;
  c.author = "selfcald";
  for (std::size_t i = 0; i < coefficient_count; ++i) {
    c.value[i] = 1e-6 * (static_cast<double>(i) - 11.5);
  }
  return c;
}

TEST(Coefficients, RecordIsLiteralAndComesBackExactly) {
  const auto bytes = encode(sample_coefficients());
  const std::array<std::uint8_t, 24> head = {'S', 'C', 'C', 'O', 0,    1,    0,    0, 0,   0,   0,   4,
                                             0,   0,   0,   0,   0x65, 0x53, 0xF1, 0, 's', 'e', 'l', 'f'};
  EXPECT_TRUE(std::equal(head.begin(), head.end(), bytes.begin()));
  const auto read = decode_coefficients(bytes);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, sample_coefficients());
}

RC_GTEST_PROP(Coefficients, AnyFlippedBitIsFound, ()) {
  auto bytes = encode(sample_coefficients());
  const auto bit = *rc::gen::inRange<std::size_t>(0, bytes.size() * 8);
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << (bit % 8));
  RC_ASSERT(!decode_coefficients(bytes).has_value());
}

TEST(Coefficients, NotFiniteAndNotAsciiAreRefused) {
  Coefficients c = sample_coefficients();
  c.value[23] = std::numeric_limits<double>::quiet_NaN();
  const auto read = decode_coefficients(encode(c));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("gyro_misalignment_zy is nan, not a finite number"));
  c = sample_coefficients();
  c.author = "a\nb";
  EXPECT_FALSE(decode_coefficients(encode(c)));
}

// The record's order is that of the 24 everywhere else, by name.
TEST(Coefficients, NamesAreThoseOfTheSensorParameters) {
  ASSERT_EQ(coefficient_names.size(), sensor_parameters.size());
  for (std::size_t i = 0; i < coefficient_names.size(); ++i) {
    EXPECT_EQ(coefficient_names[i], sensor_parameters[i].name);
  }
}

TEST(StatusFrames, LiteralBytes) {
  Status status;
  status.state = State::rotating;
  status.moving = true;
  status.faults = fault::flash;
  status.position = 19;
  status.pages_written = 0x010203;
  status.outer_deg = 270.0;
  status.inner_deg = -90.0;
  status.time_left_s = 2940.0;
  EXPECT_EQ(test::text(encode_state_frame(status, 0xAB, can_id::status)), "650#52041303020100AB");
  EXPECT_EQ(test::text(encode_gimbal_frame(status, 0xAC, can_id::gimbal)), "651#78697869D87200AC");
}

RC_GTEST_PROP(StatusFrames, ComeBackToTheirResolution, ()) {
  Status status;
  status.state = static_cast<State>(*rc::gen::inRange(0, 7));
  status.moving = *rc::gen::arbitrary<bool>();
  status.unlocked = *rc::gen::arbitrary<bool>();
  status.session = *rc::gen::inRange<std::uint8_t>(0, 4);
  status.faults = *rc::gen::arbitrary<std::uint8_t>();
  status.position = *rc::gen::arbitrary<std::uint8_t>();
  status.pages_written = *rc::gen::inRange<std::uint32_t>(0, 1U << 24U);
  status.outer_deg = *rc::gen::inRange(0, 359'990) * 1e-3;
  status.time_left_s = *rc::gen::inRange(0, 65'000) * 0.1;
  Status read;
  RC_ASSERT(apply_status_frame(encode_state_frame(status, 0, can_id::status), read));
  RC_ASSERT(apply_status_frame(encode_gimbal_frame(status, 0, can_id::gimbal), read));
  RC_ASSERT(read.state == status.state && read.moving == status.moving && read.unlocked == status.unlocked);
  RC_ASSERT(read.session == status.session);
  RC_ASSERT(read.faults == status.faults && read.position == status.position);
  RC_ASSERT(read.pages_written == status.pages_written);
  RC_ASSERT(std::abs(read.outer_deg - status.outer_deg) <= 0.005 + 1e-9);  // half of the LSB
  RC_ASSERT(std::abs(read.time_left_s - status.time_left_s) <= 0.05 + 1e-9);
}

TEST(StatusFrames, StrangersAreLeftAlone) {
  Status status;
  EXPECT_FALSE(apply_status_frame(test::frame("652#0000000000000000"), status));
  EXPECT_FALSE(apply_status_frame(test::frame("650#00000000000000"), status));
  EXPECT_FALSE(apply_status_frame(test::frame("650#0F00000000000000"), status));  // no such state
  EXPECT_FALSE(apply_status_frame(test::frame("00000650#0000000000000000"), status));
}

TEST(Records, ScheduleIsLiteralAndChecked) {
  ScheduleRecord schedule;
  schedule.rotation_ms = 5000;
  schedule.positions = {{90'000, -90'000, 150'000}};
  const Bytes bytes = encode(schedule);
  EXPECT_EQ(bytes, (Bytes{1, 0, 0, 0x13, 0x88, 0, 1, 0x5F, 0x90, 0xFF, 0xFE, 0xA0, 0x70, 0, 2, 0x49, 0xF0}));
  const auto read = decode_schedule(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, schedule);
  EXPECT_FALSE(decode_schedule(Bytes{0, 0, 0, 0, 0}));
  EXPECT_FALSE(decode_schedule(ByteView(bytes).first(16)));
  schedule.positions[0].outer_mdeg = 360'001;
  const auto refused = decode_schedule(encode(schedule));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("360001"));
}

TEST(Records, ComeBackAsTheyWere) {
  const auto state = decode_state(encode(StateRecord{State::complete, fault::gimbal, Slot::b, 9, 0xDEADBEEF, 3, 12}));
  ASSERT_TRUE(state);
  EXPECT_EQ(state->in_force, Slot::b);
  EXPECT_EQ(state->coefficients_crc, 0xDEADBEEFU);
  EXPECT_EQ(state->power_cycles, 12U);
  const auto directory = decode_directory(encode(DirectoryRecord{5, 10, 4056, 4056, 588'000, true}));
  ASSERT_TRUE(directory);
  EXPECT_EQ(directory->samples, 588'000U);
  EXPECT_TRUE(directory->complete);
  const auto format = decode_sample_format(encode(SampleFormatRecord{200.0, 1e-9, 1e-7, 1e-4, 4096, 145}));
  ASSERT_TRUE(format);
  EXPECT_EQ(format->delta_theta_lsb_rad, 1e-9);  // to the bit
  const auto run = decode_run(encode(RunRecord{State::aborted, 0, 4, 5, 77}));
  ASSERT_TRUE(run);
  EXPECT_EQ(run->pages_written, 77U);
  const auto request = decode_navigation_request(encode(NavigationCheckRequest{3600, Slot::a}));
  ASSERT_TRUE(request);
  EXPECT_EQ(request->compensation, Slot::a);
  const auto check = decode_navigation_result(encode(NavigationCheckRecord{true, 3600, -1.5, 2.5, 3.0}));
  ASSERT_TRUE(check);
  EXPECT_EQ(check->north_m, -1.5);
  const auto site = decode_site(encode(SiteRecord{40.0, 116.0, 50.0}));
  ASSERT_TRUE(site);
  EXPECT_EQ(site->longitude_deg, 116.0);
}

TEST(Records, BadValuesAreNamed) {
  const auto nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(decode_site(encode(SiteRecord{90.5, 0, 0})).error().message, HasSubstr("latitude is 90.5"));
  EXPECT_FALSE(decode_site(encode(SiteRecord{nan, 0, 0})));
  EXPECT_FALSE(decode_sample_format(encode(SampleFormatRecord{0.0, 1, 1, 1, 4096, 145})));
  const auto of_format = [](const SampleFormatRecord& record) {
    const auto read = decode_sample_format(encode(record));
    return read ? std::string("taken") : read.error().message;
  };
  EXPECT_EQ(of_format({200.0, 1e-9, 1e-7, 1e-4, 4096, 145}), "taken");
  EXPECT_THAT(of_format({1e-300, 1e-9, 1e-7, 1e-4, 4096, 145}), HasSubstr("sample rate in Hz is 1e-300"));
  EXPECT_THAT(of_format({nan, 1e-9, 1e-7, 1e-4, 4096, 145}), HasSubstr("sample rate in Hz is nan"));
  EXPECT_THAT(of_format({200.0, 1e-9, 1e-7, 1e-4, 4096, 0}), HasSubstr("samples of a page is 0"));
  EXPECT_THAT(of_format({200.0, 1e-9, 1e-7, 1e-4, 4096, 146}), HasSubstr("samples of a page is 146"));
  EXPECT_THAT(of_format({200.0, 1e-9, 1e-7, 1e-4, 512, 10}), HasSubstr("bytes of a page is 512"));
  const auto of_check = [](const NavigationCheckRecord& record) {
    const auto read = decode_navigation_result(encode(record));
    return read ? std::string("taken") : read.error().message;
  };
  EXPECT_EQ(of_check({true, 3600, -1.5, 2.5, 3.0}), "taken");
  EXPECT_THAT(of_check({true, 3600, 0, 0, 1e308}), HasSubstr("largest distance in m is 1e+308"));
  EXPECT_THAT(of_check({true, 3600, 1e308, 0, 0}), HasSubstr("distance north in m is 1e+308"));
  EXPECT_THAT(of_check({true, 3600, 0, -1e308, 0}), HasSubstr("distance east in m is -1e+308"));
  EXPECT_THAT(of_check({true, std::nan(""), 0, 0, 0}), HasSubstr("time passed in s is nan"));
  EXPECT_THAT(of_check({true, 3600, 0, 0, -5}), HasSubstr("largest distance in m is -5"));
  EXPECT_THAT(of_check({true, -1, 0, 0, 0}), HasSubstr("time passed in s is -1"));
  EXPECT_THAT(decode_site(encode(SiteRecord{0, 0, 1e9})).error().message, HasSubstr("height in m is 1000000000"));
  EXPECT_FALSE(decode_directory(encode(DirectoryRecord{5, 0, 0, 20, 7, false})));
  EXPECT_FALSE(decode_directory(encode(DirectoryRecord{5, 11, 10, 20, 0, false})));
  Bytes state = encode(StateRecord{});
  state[0] = 7;
  EXPECT_FALSE(decode_state(state));
  state[0] = 0;
  state[2] = 3;
  EXPECT_FALSE(decode_state(state));
}

TEST(Table, NoNumberIsUsedTwice) {
  std::set<std::pair<std::uint32_t, unsigned>> bits;
  for (const Signal& signal : status_signals) {
    ASSERT_LE(signal.start_bit + signal.bits, 64U) << signal.name;
    for (unsigned bit = 0; bit < signal.bits; ++bit) {
      EXPECT_TRUE(bits.insert({signal.frame_id, signal.start_bit + bit}).second) << signal.name;
    }
  }
}

TEST(Dbc, FileInConfigIsCurrent) {
  std::ifstream file(SELFCAL_SOURCE_DIR "/config/selfcal.dbc");
  std::stringstream content;
  content << file.rdbuf();
  EXPECT_EQ(content.str(), profile::dbc_text(*profile::built_in()))
      << "write it anew: selfcal_write_dbc > config/selfcal.dbc";
}

}  // namespace
}  // namespace selfcal::ins
