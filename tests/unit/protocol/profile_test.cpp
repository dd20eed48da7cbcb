// Our own INS's profile against the encoders that stand in C++: the same bytes, for records drawn at random.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"
#include "tests/unit/protocol/profile_text.hpp"

namespace selfcal::profile {
namespace {

using rc::gen::arbitrary;
using rc::gen::inRange;

template <typename T>
T any() {
  return *arbitrary<T>();
}

double any_double(double low, double high) {
  return low + (high - low) * (*inRange(0, 1'000'000'007) / 1'000'000'006.0);
}

void same(const Expected<Bytes>& by_profile, const ins::Bytes& by_hand) {
  RC_ASSERT(by_profile.has_value());
  RC_ASSERT(*by_profile == by_hand);
}

RC_GTEST_PROP(BuiltInProfile, EncodesRecordsAsOurInsDoes, ()) {
  const Profile& p = *built_in();
  const auto state = static_cast<ins::State>(*inRange(0, 7));
  const auto slot = static_cast<ins::Slot>(*inRange(0, 3));
  const ins::StateRecord s{state,
                           any<std::uint8_t>(),
                           slot,
                           any<std::uint32_t>(),
                           any<std::uint32_t>(),
                           any<std::uint32_t>(),
                           any<std::uint32_t>()};
  same(encode(p, s), ins::encode(s));
  RC_ASSERT(ins::encode(*decode_state(p, ins::encode(s))) == ins::encode(s));
  const ins::SiteRecord site{any_double(-90, 90), any_double(-360, 360), any_double(-1000, 20000)};
  same(encode(p, site), ins::encode(site));
  RC_ASSERT(ins::encode(*decode_site(p, ins::encode(site))) == ins::encode(site));
  const auto first = any<std::uint32_t>() / 2;
  const ins::DirectoryRecord d{
      any<std::uint32_t>(), first,      first + 1U + any<std::uint32_t>() / 4, any<std::uint32_t>(),
      any<std::uint64_t>(), any<bool>()};
  same(encode(p, d), ins::encode(d));
  RC_ASSERT(*decode_directory(p, ins::encode(d)) == d);
  const ins::SampleFormatRecord f{any_double(1, 2000),
                                  any_double(1e-9, 1e-6),
                                  any_double(1e-9, 1e-4),
                                  any_double(1e-8, 1e-2),
                                  4096,
                                  static_cast<std::uint16_t>(*inRange(1, 146))};
  same(encode(p, f), ins::encode(f));
  RC_ASSERT(ins::encode(*decode_sample_format(p, ins::encode(f))) == ins::encode(f));
  const ins::RunRecord r{state, any<std::uint8_t>(), any<std::uint8_t>(), any<std::uint32_t>(), any<std::uint32_t>()};
  same(encode(p, r), ins::encode(r));
  RC_ASSERT(ins::encode(*decode_run(p, ins::encode(r))) == ins::encode(r));
  const ins::NavigationCheckRequest q{any<std::uint32_t>(), slot};
  same(encode(p, q), ins::encode(q));
  RC_ASSERT(ins::encode(*decode_navigation_request(p, ins::encode(q))) == ins::encode(q));
  const ins::NavigationCheckRecord n{any<bool>(), any_double(0, 1e5), any_double(-1e5, 1e5), any_double(-1e5, 1e5),
                                     any_double(0, 1e5)};
  same(encode(p, n), ins::encode(n));
  RC_ASSERT(ins::encode(*decode_navigation_result(p, ins::encode(n))) == ins::encode(n));
}

RC_GTEST_PROP(BuiltInProfile, EncodesSchedulesAsOurInsDoes, ()) {
  ins::ScheduleRecord schedule;
  schedule.rotation_ms = any<std::uint32_t>();
  schedule.positions.resize(static_cast<std::size_t>(*inRange(1, 256)));
  for (auto& position : schedule.positions) {
    position = {*inRange(-360'000, 360'001), *inRange(-360'000, 360'001), any<std::uint32_t>()};
  }
  same(encode(*built_in(), schedule), ins::encode(schedule));
  RC_ASSERT(*decode_schedule(*built_in(), ins::encode(schedule)) == schedule);
}

RC_GTEST_PROP(BuiltInProfile, EncodesSetsAsOurInsDoes, ()) {
  ins::Coefficients set;
  set.version = any<std::uint32_t>();
  set.date_s = any<std::int64_t>();
  set.author = "selfcald";
  for (double& value : set.value) {
    value = any_double(-1, 1);
  }
  const auto by_hand = ins::encode(set);
  same(encode(*built_in(), set), ins::Bytes(by_hand.begin(), by_hand.end()));
  RC_ASSERT(*decode_coefficients(*built_in(), by_hand) == set);
  ByteView crc(by_hand);
  RC_ASSERT(*commit_start(*built_in(), by_hand) == Bytes(crc.end() - 4, crc.end()));
}

RC_GTEST_PROP(BuiltInProfile, EncodesPagesAsOurInsDoes, ()) {
  flash::Page page;
  page.run_id = any<std::uint32_t>();
  page.sequence = any<std::uint32_t>();
  page.first_sample = any<std::uint64_t>();
  page.temperature_c = any<std::int16_t>() * 0.01;
  page.flags = any<std::uint16_t>();
  page.samples.resize(static_cast<std::size_t>(*inRange(0, 146)));
  for (flash::SampleCounts& sample : page.samples) {
    for (std::size_t k = 0; k < 3; ++k) {
      sample.delta_theta[k] = any<std::int32_t>();
      sample.delta_v[k] = any<std::int32_t>();
    }
    sample.outer = any<std::uint16_t>();
    sample.inner = any<std::uint16_t>();
  }
  flash::PageBytes by_hand;
  flash::encode_page(page, by_hand);
  same(encode_page(*built_in(), page), ins::Bytes(by_hand.begin(), by_hand.end()));
  const auto read = decode_page(*built_in(), by_hand);
  RC_ASSERT(read.has_value());
  flash::PageBytes again;
  flash::encode_page(*read, again);
  RC_ASSERT(again == by_hand);
}

TEST(BuiltInProfile, HasTheNumbersOfTheTable) {
  const Profile& p = *built_in();
  EXPECT_EQ(p.bus.request, ins::can_id::request);
  EXPECT_EQ(p.bus.response, ins::can_id::response);
  EXPECT_EQ(p.bus.functional, ins::can_id::functional);
  EXPECT_EQ(p.bus.status, ins::can_id::status);
  EXPECT_EQ(p.serial, ins::did::serial_number);
  EXPECT_EQ(p.software, ins::did::software_version);
  EXPECT_EQ(p.state.did, ins::did::state);
  EXPECT_EQ(p.schedule.did, ins::did::schedule);
  EXPECT_EQ(p.site.did, ins::did::site);
  EXPECT_EQ(p.directory.did, ins::did::raw_data_directory);
  EXPECT_EQ(p.sample_format.did, ins::did::sample_format);
  EXPECT_EQ(p.set_in_force, ins::did::coefficients_in_force);
  EXPECT_EQ(p.set_inactive, ins::did::coefficients_inactive);
  EXPECT_EQ(p.set_factory, ins::did::coefficients_factory);
  EXPECT_EQ(p.rotate.id, ins::routine::self_calibration);
  EXPECT_EQ(p.erase.id, ins::routine::erase_inactive);
  EXPECT_EQ(p.commit.id, ins::routine::commit_coefficients);
  EXPECT_EQ(p.navigation_check.id, ins::routine::navigation_check);
}

// What an INS tells has any length. Nothing is read beyond it, and no shorter record has a right checksum.
TEST(BuiltInProfile, ARecordThatIsCutShortHasNoRightChecksum) {
  for (const Layout* layout : {&built_in()->set, &built_in()->raw.page}) {
    ASSERT_TRUE(layout->checksum && layout->bytes > 0);
    for (std::size_t length = 0; length < layout->bytes; ++length) {
      const auto record =
          std::make_unique<std::uint8_t[]>(length);  // of just that length, so that a sanitizer sees what is beyond
      const ByteView told(record.get(), length);
      if (length < std::max(layout->checksum->field.end(), layout->checksum->to)) {
        EXPECT_NE(stored_checksum(*layout, told), computed_checksum(*layout, told)) << layout->record << ' ' << length;
      }
    }
  }
}

TEST(Profile, TellsEveryFaultAtOnceEachWithItsLine) {
  std::string text = own_text();
  ASSERT_EQ(complaint(text), "");
  text = with(text, "response = 0x648", "response = 0x800");
  text = with(text, "fields.faults = { at = 1", "fields.faults = { at = 0");
  text = with(text, "unit = \"ms\"", "unit = \"Hz\"");
  text = with(text, "routine = 0x0302", "routine = 0x0301");
  text = with(text, "[axes]", "[axis]");
  EXPECT_THAT(complaint(text),
              testing::AllOf(testing::HasSubstr(
                                 "p.toml:8: bus.response: is 2048 (0x800), must lie between 0 (0x0) and 2047 (0x7FF)"),
                             testing::HasSubstr(": state.fields.faults: overlaps state (line "),
                             testing::HasSubstr(": schedule.fields.rotation.unit: no unit of time: Hz"),
                             testing::HasSubstr(": erase.routine: routine 0x0301 is that of rotate.routine already"),
                             testing::HasSubstr(": axis: no such key; did you mean axes?")));
}

TEST(Profile, SaysHowLongTheInsMayTake) {
  const std::string text = own_text();
  EXPECT_EQ(built_in()->timing.restart_s, 60.0);
  const auto profile =
      parse_profile(with(text, "p2_star_s = 5.0", "p2_star_s = 5.0\nerase_s = 25\nrestart_s = 120.0"), "p.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ((*profile)->timing.erase_s, 25.0);
  EXPECT_EQ((*profile)->timing.restart_s, 120.0);
  EXPECT_THAT(describe(**profile, Markup::markdown), testing::HasSubstr("25 s to erase a slot, 4 s to write a set"));
  EXPECT_THAT(complaint(with(text, "p2_star_s = 5.0", "p2_star_s = 5.0\nstop_s = 0")),
              testing::HasSubstr("timing.stop_s: "));
}

// An INS that streams its samples has no pages and no directory of them, and no frame of a sample is one of the bus.
TEST(Profile, SamplesAreStreamedOrKept) {
  const std::string stream = R"(
[stream.sample.all]
id = 0x123
bytes = 8
signals.counter = { start = 0, byte_order = "little", length = 4 }
signals.delta_theta_x = { start = 4, byte_order = "little", length = 8, type = "signed" }
signals.delta_theta_y = { start = 12, byte_order = "little", length = 8, type = "signed" }
signals.delta_theta_z = { start = 20, byte_order = "little", length = 8, type = "signed" }
signals.delta_v_x = { start = 28, byte_order = "little", length = 8, type = "signed" }
signals.delta_v_y = { start = 36, byte_order = "little", length = 8, type = "signed" }
signals.delta_v_z = { start = 44, byte_order = "little", length = 8, type = "signed" }
signals.outer = { start = 52, byte_order = "little", length = 6, scale = 6.0, unit = "deg" }
signals.inner = { start = 58, byte_order = "little", length = 6, scale = 6.0, unit = "deg" }
)";
  std::string text = own_text();
  for (const std::string_view table : {"[directory]", "[upload]", "[page]"}) {
    const std::size_t from = text.find(table), to = text.find("\n[", from);
    ASSERT_NE(from, std::string::npos) << table;
    text.erase(from, to - from);
  }
  const std::string format = "\n[sample_format]";
  const std::size_t from = text.find(format), to = text.find("\n[", from + 1);
  text.replace(
      from, to - from,
      "\n[sample_format]\ngiven.sample_rate = 100\ngiven.angle_per_count = 1e-6\ngiven.velocity_per_count = 1e-5\n");
  const auto profile = parse_profile(text + stream, "p.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ((*profile)->raw.way, Raw::Way::stream);
  EXPECT_EQ(sample_frames(**profile).size(), 1U);
  EXPECT_FALSE(told_directory(**profile));
  EXPECT_THAT(describe(**profile, Markup::markdown), testing::Not(testing::HasSubstr("0xFFFF |")));

  EXPECT_THAT(complaint(own_text() + stream),
              testing::AllOf(testing::HasSubstr(": directory: the samples are streamed: the INS tells none"),
                             testing::HasSubstr(": page: the samples are streamed: there are none"),
                             testing::HasSubstr("the raw data come in one way")));
  EXPECT_THAT(complaint(text + with(stream, "id = 0x123", "id = 0x648")),
              testing::HasSubstr("stream.sample.all.id: 0x648 is that of bus.response already"));
  EXPECT_THAT(complaint(text + with(stream, "signals.inner", "# signals.inner")),
              testing::HasSubstr("inner is told by no frame"));
  EXPECT_THAT(
      complaint(with(text, "given.sample_rate = 100", "given.sample_rate = 100\ngiven.page_bytes = 4096") + stream),
      testing::HasSubstr("sample_format.given.page_bytes: the samples are streamed"));
}

// Another INS's: what it writes it reads, to half of what its fields resolve.
class ExampleProfile : public testing::Test {
 protected:
  static ProfilePtr example() {
    auto profile = load_profile(SELFCAL_SOURCE_DIR "/config/profiles/example.toml");
    return profile ? *profile : throw std::runtime_error(profile.error().message);
  }
  ProfilePtr profile_ = example();
};

TEST_F(ExampleProfile, HasTheAddressesOfNormalFixedAddressing) {
  EXPECT_TRUE(profile_->bus.extended_ids);
  EXPECT_EQ(profile_->bus.request, 0x18DA2AF1U);
  EXPECT_EQ(profile_->bus.response, 0x18DAF12AU);
  EXPECT_EQ(profile_->bus.functional, 0x18DB33F1U);
}

TEST_F(ExampleProfile, PutsTheBitsWhereItsFileSays) {
  const ins::StateRecord state{ins::State::failed, 0x5A, ins::Slot::b, 0x0102, 7, 0x11223344, 0x55667788};
  // State 15 and slot 1 in the low byte, faults in the high one; everything little-endian.
  EXPECT_EQ(encode(*profile_, state).value(),
            (Bytes{0x1F, 0x5A, 0x02, 0x01, 0x44, 0x33, 0x22, 0x11, 0x88, 0x77, 0x66, 0x55}));
  const ins::ScheduleRecord schedule{{{90'000, -45'000, 2500}}, 5000};
  // 50 tenths of a second; inner turned round, +450 tenths of a degree, before outer, 900.
  EXPECT_EQ(encode(*profile_, schedule).value(), (Bytes{50, 0, 1, 0, 0xC2, 0x01, 0x84, 0x03, 0xC4, 0x09, 0, 0}));
  EXPECT_EQ(*decode_schedule(*profile_, encode(*profile_, schedule).value()), schedule);
  const ins::SiteRecord site{40.0, -116.5, 50.25};
  const auto bytes = encode(*profile_, site).value();
  EXPECT_EQ((Bytes(bytes.begin() + 8, bytes.end())), (Bytes{0xA1, 0x13, 0, 0}));  // 5025 cm
  EXPECT_NEAR(decode_site(*profile_, bytes)->longitude_deg, -116.5, 0.5e-7);
}

TEST_F(ExampleProfile, TurnsTheAxesOfAPage) {
  flash::Page page;
  page.run_id = 9;
  page.sequence = 3;
  page.temperature_c = 25.0;
  page.samples = {{{1, 2, 3}, {-4, -5, -6}, 16384, 49152}};
  const Bytes bytes = encode_page(*profile_, page).value();
  ASSERT_EQ(bytes.size(), 1024U);
  // Our x is its y, our y its -x: its x is our -y, its y our x. First 90 deg of outer and, of inner turned round, 90 as well.
  const Bytes sample(bytes.begin() + 12, bytes.begin() + 38);
  EXPECT_EQ(sample, (Bytes{0x40, 0x54, 0x89, 0,    0x40, 0x54, 0x89, 0, 5, 0, 0, 0xFC, 0xFF,
                           0xFF, 0xFA, 0xFF, 0xFF, 0xFE, 0xFF, 0xFF, 1, 0, 0, 3, 0,    0}));
  const auto read = decode_page(*profile_, bytes);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->samples, page.samples);
  EXPECT_EQ(read->first_sample, 3U * 38U);  // of full pages, since the INS does not tell it
  EXPECT_EQ(read->temperature_c, 25.0);
  Bytes spoilt = bytes;
  spoilt[500] ^= 1;
  EXPECT_THAT(decode_page(*profile_, spoilt).error().message, testing::HasSubstr("page record: CRC"));
}

RC_GTEST_FIXTURE_PROP(ExampleProfile, KeepsASetToRounding, ()) {
  ins::Coefficients set;
  set.version = any<std::uint32_t>();
  set.date_s = any<std::uint32_t>();
  for (double& value : set.value) {
    value = any_double(-1e-2, 1e-2);
  }
  const auto read = decode_coefficients(*profile_, encode(*profile_, set).value());
  RC_ASSERT(read.has_value());
  RC_ASSERT(read->version == set.version);
  for (std::size_t k = 0; k < set.value.size(); ++k) {
    // Two conversions of f64, each to half of its last bit.
    RC_ASSERT(std::abs(read->value[k] - set.value[k]) <= 4 * std::abs(set.value[k]) * 1.2e-16);
  }
}

TEST(Profile, OneFactorInPlaceOfTwoKeepsTheMeanOfBothSlopes) {
  std::string text = own_text();
  text = with(
      text, "fields.values = { at = 52, type = \"f64\", count = 24 }",
      "fields.accel_scale = { at = 52, type = \"f64\", count = 3 }\nfields.accel_bias = { at = 76, type = \"f64\", "
      "count = 3 }\nfields.gyro_drift = { at = 100, type = \"f64\", count = 3 }\nfields.gyro_scale = { at = 124, type "
      "= \"f64\", count = 3 }\nfields.accel_misalignment = { at = 148, type = \"f64\", count = 3 "
      "}\nfields.gyro_misalignment = { at = 172, type = \"f64\", count = 6 }");
  const auto profile = parse_profile(text, "p.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  ins::Coefficients set;
  set.value[6] = 162e-6;   // K+ and K- of x, the paper's
  set.value[9] = -151e-6;  // K- multiplies |f|: a plain factor k is K+ = k, K- = -k
  const auto read = decode_coefficients(**profile, encode(**profile, set).value());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_DOUBLE_EQ(read->value[6], 156.5e-6);
  EXPECT_DOUBLE_EQ(read->value[9], -156.5e-6);
}

// Without slots, field by field, from memory.
TEST(MemoryProfile, HasAnIdentifierForEachFieldAndOneFactor) {
  const auto profile = load_profile(SELFCAL_SOURCE_DIR "/config/profiles/memory.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Profile& p = **profile;
  EXPECT_FALSE(p.slots);
  EXPECT_TRUE(p.field_by_field);
  EXPECT_EQ(p.set.fields.size(), 22U);
  EXPECT_EQ(p.set.bytes, 2U + 12 * 4 + 9 * 4);
  EXPECT_EQ(p.set.fields.back().name, "version");  // written last
  EXPECT_EQ(p.raw.way, Raw::Way::memory);
  EXPECT_EQ(p.raw.page.most_repetitions(), 63U);  // (2048 - 12) / 32
  ins::Coefficients set;
  set.version = 3;
  const std::size_t plus = 6, minus = 9;  // K+ and K- of x, behind three biases and three drifts
  set.value[plus] = 101e-6;
  set.value[minus] = -99e-6;
  const auto bytes = encode(p, set);
  ASSERT_TRUE(bytes);
  const Field* factor = p.set.find("accel_scale_x");
  EXPECT_EQ(factor->did, 0x4107);
  // (101 + 99) / 2 ppm in counts of 0.001 ppm: 100,000.
  EXPECT_EQ((Bytes(bytes->begin() + static_cast<std::ptrdiff_t>(factor->at),
                   bytes->begin() + static_cast<std::ptrdiff_t>(factor->end()))),
            (Bytes{0x00, 0x01, 0x86, 0xA0}));
  const auto held = decode_coefficients(p, *bytes);
  ASSERT_TRUE(held);
  EXPECT_NEAR(held->value[plus], 100e-6, 1e-15);
  EXPECT_NEAR(held->value[minus], -100e-6, 1e-15);
}

// ISO 15765-2, 10.3: extended addressing has the address of who is meant in the first byte, mixed addressing the extension.
TEST(Profile, FramesMayBeginWithAnAddress) {
  const std::string normal =
      "addressing = \"normal\"      # identifiers of 11 bits\nrequest = 0x640\nresponse = 0x648\nfunctional = 0x7DF\n";
  const std::string extended = with(own_text(), normal,
                                    "addressing = \"extended\"\nrequest = 0x6F1\nresponse = 0x612\nfunctional = 0x6F1\n"
                                    "ins_address = 0x12\ntester_address = 0xF1\nfunctional_address = 0xDF\n");
  const auto one = parse_profile(extended, "p.toml");
  ASSERT_TRUE(one) << one.error().message;
  const Bus& a = (*one)->bus;
  EXPECT_FALSE(a.extended_ids);
  EXPECT_EQ(std::tuple(a.request, a.request_byte, a.response, a.response_byte, a.functional, a.functional_byte),
            std::tuple(0x6F1, 0x12, 0x612, 0xF1, 0x6F1, 0xDF));
  EXPECT_THAT(
      describe(**one, Markup::markdown),
      testing::HasSubstr("The first byte of each frame is an address: 0x12 in requests, 0xF1 in responses, 0xDF in"));

  const std::string mixed = with(own_text(), normal,
                                 "addressing = \"mixed-29\"\nins_address = 0x2A\ntester_address = 0xF1\n"
                                 "address_extension = 0x5C\n");
  const auto other = parse_profile(mixed, "p.toml");
  ASSERT_TRUE(other) << other.error().message;
  const Bus& b = (*other)->bus;
  EXPECT_TRUE(b.extended_ids);
  EXPECT_EQ(std::tuple(b.request, b.response, b.functional), std::tuple(0x18CE2AF1, 0x18CEF12A, 0x18CD33F1));
  EXPECT_EQ(b.request_byte, 0x5C);

  EXPECT_THAT(complaint(with(extended, "functional_address = 0xDF", "functional_address = 0x12")),
              testing::HasSubstr("bus.functional_address: 0x12 is that of the INS already"));
  EXPECT_THAT(complaint(with(extended, "response = 0x612", "response = 0x6F1")),
              testing::HasSubstr("bus.response: identifier 0x06F1 is that of bus.request already"));
  EXPECT_THAT(complaint(with(extended, "tester_address = 0xF1\n", "")),
              testing::HasSubstr("bus.tester_address: missing"));
  EXPECT_THAT(complaint(with(extended, "tester_address = 0xF1", "tester_address = 256")),
              testing::HasSubstr("bus.tester_address: is 256"));
  EXPECT_THAT(complaint(with(mixed, "address_extension = 0x5C", "address_extension = 0x15C")),
              testing::HasSubstr("bus.address_extension: is 348"));
  EXPECT_THAT(complaint(with(mixed, "ins_address", "request = 0x640\nins_address")),
              testing::HasSubstr("bus.request: no such key"));
}

// By a program of the user's own; its path begins in the folder of the profile.
TEST(Profile, ALockMayBeOpenedByAProgram) {
  const std::string lock = "method = \"program\"\nprogram = \"keys/open\"\nseed_bytes = 6\nkey_bytes = 4\n";
  const std::string text = with(own_text(), "method = \"aes-cmac\"\n", lock);
  const auto profile = parse_profile(text, "/etc/selfcal/profiles/p.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Security& security = (*profile)->security;
  ASSERT_TRUE(security.program);
  EXPECT_EQ(security.program->file, "/etc/selfcal/profiles/keys/open");
  EXPECT_EQ(security.program->key_bytes, 4);
  EXPECT_EQ(security.seed_bytes, 6);
  EXPECT_FALSE(security.program->seed_as_argument);
  const std::string words = describe(**profile, Markup::markdown);
  EXPECT_THAT(words, testing::HasSubstr("6 bytes of seed"));
  EXPECT_THAT(words, testing::HasSubstr("KEY has 4 bytes; a program of the user's own says it, open, which gets"));

  const auto fault = [&](std::string_view was, std::string_view is) { return complaint(with(text, was, is)); };
  EXPECT_THAT(fault("program = \"keys/open\"\n", ""), testing::HasSubstr("security.program: missing"));
  EXPECT_THAT(fault("program = \"keys/open\"", "program = \"\""), testing::HasSubstr("security.program: is empty"));
  EXPECT_THAT(fault("seed_bytes = 6", "seed_bytes = 65"), testing::HasSubstr("security.seed_bytes: is 65"));
  EXPECT_THAT(fault("key_bytes = 4\n", ""), testing::HasSubstr("security.key_bytes: missing"));
  EXPECT_THAT(fault("key_bytes = 4", "key_bytes = 4\nlimit_s = 0"), testing::HasSubstr("security.limit_s"));
  EXPECT_THAT(fault("key_bytes = 4", "key_bytes = 4\nseed = \"file\""), testing::HasSubstr("security.seed"));
  EXPECT_THAT(fault("method = \"program\"", "method = \"aes-cmac\""),
              testing::HasSubstr("security.program: no such key"));
}

// An INS that knows its schedule says how many pages there will be.
TEST(Profile, PagesExpectedAreNeededBesideASchedule) {
  EXPECT_THAT(complaint(with(own_text(), "fields.pages_expected", "# fields.pages_expected")),
              testing::HasSubstr("directory.fields.pages_expected: missing"));
}

// Each fault is told with its line; what cannot be together is.
TEST(MemoryProfile, WhatDoesNotFitTogetherIsRefused) {
  std::ifstream in(SELFCAL_SOURCE_DIR "/config/profiles/memory.toml");
  std::stringstream content;
  content << in.rdbuf();
  const std::string whole = content.str();
  const auto fault = [&](std::string_view was, std::string_view is) { return complaint(with(whole, was, is)); };
  ASSERT_EQ(complaint(whole), "");
  EXPECT_THAT(fault("slots = false", "slots = true"), testing::HasSubstr("an INS with slots needs two"));
  EXPECT_THAT(fault("did = 0x4102", "did = 0x4101"),
              testing::HasSubstr("0x4101 is that of coefficients.fields.accel_bias_x.did already"));
  EXPECT_THAT(fault("did = 0x4102, ", ""), testing::HasSubstr("coefficients.fields.accel_bias_y.did: missing"));
  EXPECT_THAT(fault("[memory]", "[upload]\naddress = \"page\"\n\n[memory]"), testing::HasSubstr("come in one way"));
  EXPECT_THAT(fault("longest = 512", "longest = 70000"), testing::HasSubstr("memory.longest"));
  EXPECT_THAT(fault("[memory]", "[erase]\nroutine = 0x4202\n\n[memory]"), testing::HasSubstr("without slots"));
}

}  // namespace
}  // namespace selfcal::profile
