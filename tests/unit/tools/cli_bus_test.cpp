// selfcal bus decode on literal logs. (bus log needs a CAN interface: it runs in the integration tests.)
#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/recording/atomic_file.hpp"
#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using test::failure_fault;
using test::run_selfcal;
using ::testing::HasSubstr;

constexpr const char* read_serial_number =
    "(1436509052.249713) can0 640#0322F18CCCCCCCCC\n"
    "(1436509052.250713) can0 648#100B62F18C53494D\n"
    "(1436509052.251713) can0 640#300000CCCCCCCCCC\n"
    "(1436509052.252713) can0 648#212D30303031CCCC\n"
    "(1436509052.253713) can0 648#037F2222CCCCCCCC\n";

TEST(BusDecode, NamesRequestResponseAndRefusal) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "bus.log", read_serial_number));
  const auto finished = run_selfcal({"bus", "decode", folder / "bus.log"});
  EXPECT_EQ(finished.status, 0) << finished.error;
  EXPECT_THAT(finished.out, HasSubstr("ReadDataByIdentifier"));
  EXPECT_THAT(finished.out, HasSubstr("identity.serial (0xF18C): \"SIM-0001\""));
  EXPECT_THAT(finished.out, HasSubstr("onditionsNotCorrect"));  // NRC 0x22
  EXPECT_EQ(std::count(finished.out.begin(), finished.out.end(), '\n'), 3) << finished.out;
}

// The same as JSON: of a seed only that it is one, and how long.
TEST(BusDecode, AsJsonWithHeadAndWithoutSecrets) {
  const test::TemporaryFolder folder;
  const std::string seed = "(1436509052.254713) can0 648#066701DEADBEEFCC\n";
  ASSERT_TRUE(write_file_atomically(folder / "bus.log", read_serial_number + seed));
  const auto finished = run_selfcal({"bus", "decode", "--json", folder / "bus.log"});
  EXPECT_EQ(finished.status, 0) << finished.error;
  const auto document = nlohmann::ordered_json::parse(finished.out);
  EXPECT_EQ(document.begin().key(), "schema");
  EXPECT_EQ(document.at("schema").at("name"), "selfcal.bus");
  EXPECT_EQ(document.at("input").at("sha256").get<std::string>().size(), 64U);
  const auto& entries = document.at("entries");
  ASSERT_EQ(entries.size(), 4U);
  EXPECT_EQ(entries[0].at("from"), "tester");
  EXPECT_EQ(entries[0].at("kind"), "request");
  EXPECT_EQ(entries[0].at("bytes"), "22F18C");
  EXPECT_EQ(entries[1].at("kind"), "response");
  EXPECT_EQ(entries[1].at("service"), "ReadDataByIdentifier");
  EXPECT_EQ(entries[1].at("bytes"), "62F18C53494D2D30303031");
  EXPECT_EQ(entries[2].at("kind"), "refusal");
  EXPECT_EQ(entries[2].at("nrc").at("code"), 0x22);
  EXPECT_EQ(entries[3].at("bytes"), "6701");
  EXPECT_EQ(entries[3].at("length"), 6);
  EXPECT_THAT(finished.out, testing::Not(HasSubstr("DEAD")));
}

TEST(BusDecode, OtherIdentifiersAreOthersBusiness) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "bus.log", read_serial_number));
  const auto finished =
      run_selfcal({"bus", "decode", "--request-id", "0x700", "--response-id", "0x708", folder / "bus.log"});
  EXPECT_EQ(finished.status, 0) << finished.error;
  EXPECT_EQ(finished.out, "");
}

TEST(BusDecode, StatusFramesAreSignalsByNameAndUnit) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "bus.log",
                                    "(1.000000) can0 650#0100000000000007\n(1.100000) can0 651#2823000064000009\n"));
  const auto finished = run_selfcal({"bus", "decode", folder / "bus.log"});
  EXPECT_EQ(finished.status, 0) << finished.error;
  EXPECT_THAT(finished.out, HasSubstr("State=idle GimbalMoving=0 "));
  EXPECT_THAT(finished.out, HasSubstr("PagesWritten=0 "));
  EXPECT_THAT(finished.out, HasSubstr("OuterAngle=90 deg InnerAngle=0 deg TimeLeft=10 s"));
}

TEST(BusDecode, MissingFrameIsTold) {
  const test::TemporaryFolder folder;
  std::string log = read_serial_number;
  const std::size_t third = log.find("(1436509052.252713)");
  log.erase(third, log.find('\n', third) + 1 - third);  // the consecutive frame
  ASSERT_TRUE(write_file_atomically(folder / "bus.log", log));
  const auto finished = run_selfcal({"bus", "decode", folder / "bus.log"});
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.error, HasSubstr("1 of"));
}

TEST(BusDecode, WhatIsNoLogIsNamedByLine) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_file_atomically(folder / "bus.log", std::string(read_serial_number) + "junk\n"));
  const auto finished = run_selfcal({"bus", "decode", folder / "bus.log"});
  EXPECT_EQ(finished.status, 3);
  EXPECT_THAT(finished.error, HasSubstr("line 6"));
  EXPECT_EQ(failure_fault(run_selfcal({"bus", "decode", folder / "absent.log"}), 3), "");
  EXPECT_EQ(failure_fault(run_selfcal({"bus", "log", "no-such-can"}), 4), "");
  EXPECT_EQ(failure_fault(run_selfcal({"bus"}), 2), "");
}

}  // namespace
}  // namespace selfcal
