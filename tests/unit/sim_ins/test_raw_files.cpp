// Raw data as files: our own INS's profile with RequestFileTransfer in the place of RequestUpload.
#include <gtest/gtest.h>

#include <string>

#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tests/unit/sim_ins/diagnostics_fixture.hpp"

namespace selfcal::sim {
namespace {

profile::ProfilePtr with_files() {
  std::string text(profile::built_in_text());
  const std::string upload = "[upload]\n";
  const std::size_t begin = text.find(upload), end = text.find("[page]");
  text.replace(begin, end - begin, "[file]\nname = \"/raw/{run}/{page:4}\"\n\n");
  return profile::parse_profile(text, "files.toml").value();
}

class RawFiles : public DiagnosticsTest {
 protected:
  RawFiles() : DiagnosticsTest(with_files()) {}
  void SetUp() override {
    unlock();
    ASSERT_EQ(nrc_of(schedule(20000)), Nrc::none);
    ASSERT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::none);
    run_for(6.5);  // 325 samples, 2 pages of 145
  }
};

TEST_F(RawFiles, APageIsAFile) {
  const uds::Bytes answer = ask(uds::file_request("/raw/7/0001"));
  ASSERT_GT(answer.size(), 8U);
  const auto told = uds::read_file_response(answer);
  ASSERT_TRUE(told) << told.error().message;
  EXPECT_EQ(told->bytes, flash::page_bytes);
  uds::Bytes data;
  for (std::uint8_t block = 1; data.size() < told->bytes; ++block) {
    const uds::Bytes part = ask(uds::transfer_request(block));
    ASSERT_GT(part.size(), 2U);
    ASSERT_LE(part.size(), told->longest);
    data.insert(data.end(), part.begin() + 2, part.end());
  }
  EXPECT_EQ(nrc_of(uds::transfer_exit_request()), Nrc::none);
  flash::Page page;
  ASSERT_TRUE(flash::decode_page(data, page));
  EXPECT_EQ(page.run_id, 7U);
  EXPECT_EQ(page.sequence, 1U);
}

// ISO 14229-1, 14.6.4: shortest length, mode, length of all of it, then what it asks for.
TEST_F(RawFiles, WhatIsWrongIsRefusedInTheOrderOfTheStandard) {
  EXPECT_EQ(nrc_of({0x38, 4, 0, 1, 0}), Nrc::incorrect_message_length);
  EXPECT_EQ(nrc_of({0x38, 2, 0, 2, 'a', 0}), Nrc::request_out_of_range);
  EXPECT_EQ(nrc_of({0x38, 4, 0, 2, 'a', 0}), Nrc::incorrect_message_length);
  uds::Bytes compressed = uds::file_request("/raw/7/0001");
  compressed.back() = 0x10;
  EXPECT_EQ(nrc_of(compressed), Nrc::request_out_of_range);
  EXPECT_EQ(nrc_of(uds::file_request("/raw/7/0002")), Nrc::request_out_of_range);  // not written yet
  EXPECT_EQ(nrc_of(uds::file_request("/raw/6/0001")), Nrc::request_out_of_range);  // of another run
  EXPECT_EQ(nrc_of(uds::file_request("/raw/7/1")), Nrc::request_out_of_range);
  EXPECT_EQ(nrc_of(uds::transfer_request(1)), Nrc::request_sequence_error);
  EXPECT_EQ(nrc_of(uds::upload_request(0, flash::page_bytes)), Nrc::service_not_supported);
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::standard)), Nrc::none);
  EXPECT_EQ(nrc_of(uds::file_request("/raw/7/0001")), Nrc::service_not_supported_in_session);
}

// And the other way round: our own INS knows no files.
TEST_F(DiagnosticsTest, KnowsNoFiles) {
  unlock();
  EXPECT_EQ(nrc_of(uds::file_request("/raw/7/0001")), Nrc::service_not_supported);
}

}  // namespace
}  // namespace selfcal::sim
