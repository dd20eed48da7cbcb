// Records in the INS's memory in place of identifiers: the bytes that go over the bus for config/profiles/addresses.toml, and what does
// not fit together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "protocol/profile/describe.hpp"
#include "protocol/profile/names.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "tests/unit/protocol/profile_text.hpp"

namespace selfcal::profile {
namespace {

using testing::HasSubstr;

std::string text_of(const std::string& name) {
  std::ifstream in(SELFCAL_SOURCE_DIR "/config/profiles/" + name);
  std::stringstream content;
  content << in.rdbuf();
  return content.str();
}

TEST(RecordMemory, HasANumberForEachRecordThatNoInsHas) {
  const auto profile = load_profile(SELFCAL_SOURCE_DIR "/config/profiles/addresses.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Profile& p = **profile;
  EXPECT_EQ(p.memory.regions.size(), 8U);
  for (const auto& [did, address, bytes] :
       {std::tuple(std::optional(p.serial), 0x040000U, 16U), std::tuple(std::optional(p.software), 0x040010U, 12U),
        std::tuple(p.state.did, 0x040100U, 12U), std::tuple(p.schedule.did, 0x040200U, 260U),
        std::tuple(p.site.did, 0x040400U, 24U), std::tuple(p.directory.did, 0x040500U, 20U),
        std::tuple(p.sample_format.did, 0x040600U, 12U), std::tuple(p.set_in_force, 0x048000U, 204U)}) {
    ASSERT_TRUE(did);
    EXPECT_LE(*did, 0x00FF);  // ISO 14229-1, table C.1: reserved
    const Region* region = p.memory.find(*did);
    ASSERT_NE(region, nullptr);
    EXPECT_EQ(region->address, address);
    EXPECT_EQ(region->bytes, bytes);
    EXPECT_EQ(is_written(p, *did), address == 0x040200U || address == 0x048000U);
  }
  EXPECT_EQ(p.raw.way, Raw::Way::upload);
}

// 204 bytes in parts of 64 that are read and of 48 that are written; three bytes of address, one of size.
TEST(RecordMemory, ALongRecordIsReadAndWrittenInParts) {
  const auto profile = load_profile(SELFCAL_SOURCE_DIR "/config/profiles/addresses.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const RecordMemory& memory = (*profile)->memory;
  const Region& set = *memory.find(*(*profile)->set_in_force);
  const auto reads = parts_of(set, memory.longest_read), writes = parts_of(set, memory.longest_write);
  ASSERT_EQ(reads.size(), 4U);
  ASSERT_EQ(writes.size(), 5U);
  EXPECT_EQ(memory.read_request(reads[0]), (Bytes{0x23, 0x13, 0x04, 0x80, 0x00, 0x40}));
  EXPECT_EQ(memory.read_request(reads[3]), (Bytes{0x23, 0x13, 0x04, 0x80, 0xC0, 0x0C}));
  Bytes record(204);
  for (std::size_t k = 0; k < record.size(); ++k) {
    record[k] = static_cast<std::uint8_t>(k);
  }
  EXPECT_EQ(memory.write_request(writes[4], record, set),
            (Bytes{0x3D, 0x13, 0x04, 0x80, 0xC0, 0x0C, 192, 193, 194, 195, 196, 197, 198, 199, 200, 201, 202, 203}));
  EXPECT_EQ(memory.holding(0x048000, 204), (*profile)->set_in_force);
  EXPECT_EQ(memory.holding(0x0480CB, 1), (*profile)->set_in_force);
  EXPECT_EQ(memory.holding(0x0480CB, 2), std::nullopt);
  EXPECT_EQ(memory.holding(0x047FFF, 2), std::nullopt);
}

TEST(RecordMemory, AFieldOfASetMayHaveAnAddress) {
  // 0x4107 stands at 0x70000070.
  const std::string text =
      std::regex_replace(text_of("memory.toml"), std::regex("did = 0x41(..)"), "memory = 0x70000$010");
  const auto profile = parse_profile(text, "p.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const Profile& p = **profile;
  const Field* factor = p.set.find("accel_scale_x");
  const Region* region = p.memory.find(*factor->did);
  ASSERT_NE(region, nullptr);
  EXPECT_EQ(region->address, 0x70000070U);
  EXPECT_EQ(region->bytes, 4U);
  EXPECT_TRUE(is_written(p, *factor->did));
  EXPECT_EQ(did_name(p, *factor->did), "coefficients.accel_scale_x");
  EXPECT_EQ(p.raw.way, Raw::Way::memory);  // as before
}

TEST(RecordMemory, IsDescribedAndDecodedByName) {
  const auto profile = load_profile(SELFCAL_SOURCE_DIR "/config/profiles/addresses.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  const std::string words = describe(**profile, Markup::markdown);
  EXPECT_THAT(words, HasSubstr("| 23 13 ADDRESS SIZE | 63 DATA |"));
  EXPECT_THAT(words, HasSubstr("| 3D 13 ADDRESS SIZE DATA | 7D 13 ADDRESS SIZE |"));
  EXPECT_THAT(words, HasSubstr("| 0x48000 | 204 | coefficients, used from the next power-on on | read, write |"));
  EXPECT_THAT(words, testing::Not(HasSubstr("22 DID")));
  const uds::Names names = decoder_options(*profile).names;
  EXPECT_TRUE(names.dids.empty());
  EXPECT_EQ(uds::describe_message(Bytes{0x23, 0x13, 0x04, 0x80, 0x40, 0x40}, names),
            "ReadMemoryByAddress (0x23) coefficients.in_force from 0x48040, 64 bytes");
  EXPECT_EQ(uds::describe_message(Bytes{0x3D, 0x13, 0x04, 0x02, 0x00, 0x02, 1, 2}, names),
            "WriteMemoryByAddress (0x3D) schedule from 0x40200, 2 bytes: 01 02");
  EXPECT_EQ(uds::describe_message(Bytes{0x7D, 0x13, 0x04, 0x02, 0x00, 0x02}, names),
            "positive WriteMemoryByAddress (0x7D) schedule from 0x40200, 2 bytes");
  EXPECT_EQ(uds::describe_message(Bytes{0x23, 0x13, 0x00, 0x00, 0x01, 0x01}, names),
            "ReadMemoryByAddress (0x23) from 0x1, 1 bytes");
  EXPECT_EQ(uds::describe_message(Bytes{0x63, 7}, names), "positive ReadMemoryByAddress (0x63): 07");
  EXPECT_EQ(uds::describe_message(Bytes{0x23, 0x13, 0x04}, names), "ReadMemoryByAddress (0x23): 13 04");
}

TEST(RecordMemory, WhatDoesNotFitTogetherIsRefused) {
  const std::string whole = text_of("addresses.toml");
  const auto fault = [&](std::string_view was, std::string_view is) { return complaint(with(whole, was, is)); };
  ASSERT_EQ(complaint(whole), "");
  EXPECT_THAT(fault("memory = 0x040100\n", "memory = 0x040100\ndid = 0x4001\n"),
              HasSubstr("state.memory: and did (line 35): a record is told in one way"));
  EXPECT_THAT(fault("memory = 0x040100\n", ""), HasSubstr("state.did: missing, and there is no memory in its place"));
  EXPECT_THAT(fault("memory = 0x040100\n", "memory = 0xFFFFF8\n"),
              HasSubstr("state.memory: bytes 0xFFFFF8 to 0x1000003 do not fit an address of 3 bytes"));
  EXPECT_THAT(fault("memory = 0x040100\n", "memory = 0x100000000\n"),
              HasSubstr("p.toml:34: state.memory: is 4294967296"));
  const std::string overlap = fault("memory = 0x040500", "memory = 0x0402FC");
  EXPECT_THAT(overlap,
              HasSubstr("p.toml:43: schedule.memory: overlaps directory.memory (line 62), bytes 0x402FC to 0x4030F"));
  EXPECT_THAT(overlap,
              HasSubstr("p.toml:62: directory.memory: overlaps schedule.memory (line 43), bytes 0x40200 to 0x40303"));
  EXPECT_THAT(fault("software = { memory = 0x040010", "software = { memory = 0x04000F"),
              HasSubstr("identity.software.memory: overlaps identity.serial.memory"));
  EXPECT_THAT(fault("serial = { memory = 0x040000, bytes = 16 }", "serial = { memory = 0x040000 }"),
              HasSubstr("identity.serial.bytes: missing"));
  EXPECT_THAT(fault("serial = { memory = 0x040000, bytes = 16 }", "serial = { bytes = 16 }"),
              HasSubstr("identity.serial.memory: missing"));
  EXPECT_THAT(fault("bytes = 260\n", ""),
              HasSubstr("schedule.bytes: missing: a record in memory has the same length always"));
  EXPECT_THAT(fault("in_force = { memory = 0x048000 }", "in_force = { memory = 0x048000, did = 3 }"),
              HasSubstr("coefficients.in_force.did: no such key"));
  EXPECT_THAT(fault("longest = 64", "longest = 256"), HasSubstr("memory.longest: is 256"));
  EXPECT_THAT(fault("longest_write = 48", "longest_write = 0"), HasSubstr("memory.longest_write: is 0"));
  EXPECT_THAT(fault("longest = 64\n", ""), HasSubstr("memory.longest: missing"));
  const auto begin = whole.find("[memory]"), end = whole.find("[identity]");
  EXPECT_THAT(complaint(whole.substr(0, begin) + whole.substr(end)), HasSubstr("state.memory: needs [memory] with"));
  EXPECT_THAT(fault("longest = 64", "longest = 64\naddress = 0x40000"), HasSubstr("upload: and another"));
  EXPECT_THAT(fault("longest = 64", "longest = 64\nend = 0x40000"), HasSubstr("memory.end: no such key"));
  EXPECT_THAT(fault("[upload]\naddress = \"byte\"\naddress_bytes = 4\nsize_bytes = 4\n", ""),
              HasSubstr("p.toml:23: memory.address: missing, and there is no upload, file or stream in its place"));
}

TEST(RecordMemory, RecordsStandOutsideTheRawData) {
  const std::string whole = with(text_of("memory.toml"), "did = 0x4001", "memory = 0x80000200");
  EXPECT_THAT(complaint(whole),
              HasSubstr("state.memory: bytes 0x80000200 to 0x80000209 overlap the raw data, which stand from "
                        "0x80000000 to 0xFFFFFFFF (memory, line"));
  EXPECT_EQ(complaint(with(whole, "longest = 512", "longest = 512\nend = 0x80000200")), "");
  EXPECT_THAT(complaint(with(whole, "longest = 512", "longest = 512\nend = 0x80000201")),
              HasSubstr("overlap the raw data"));
  EXPECT_THAT(complaint(with(whole, "longest = 512", "longest = 512\nend = 0x80000000")), HasSubstr("memory.end: is"));
  EXPECT_EQ(complaint(with(text_of("memory.toml"), "did = 0x4001", "memory = 0x7FFFFFF6")), "");
}

}  // namespace
}  // namespace selfcal::profile
