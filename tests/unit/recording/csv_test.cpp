#include "protocol/recording/csv.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "protocol/recording/atomic_file.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Csv : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(write_csv(test::sample_recording(), folder / "r.csv"));
    csv = read_text_file(folder / "r.csv", 1 << 24).value();
    toml = read_text_file(folder / "r.toml", 1 << 24).value();
  }
  std::string error() const {
    const auto parsed = parse_csv(csv, toml, "r.csv");
    return parsed ? "no error" : parsed.error().message;
  }
  // Replaces the first occurrence.
  static void replace(std::string& text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  // The start of line `number` (1 is the header).
  std::size_t line(std::size_t number) const {
    std::size_t at = 0;
    while (--number > 0) {
      at = csv.find('\n', at) + 1;
    }
    return at;
  }

  test::TemporaryFolder folder;
  std::string csv;
  std::string toml;
};

TEST_F(Csv, ReadsBackToTheSameBits) {
  const auto loaded = read_csv(folder / "r.csv");
  ASSERT_TRUE(loaded) << loaded.error().message;
  const Recording expected = test::sample_recording();
  const Recording& read = loaded->recording;
  EXPECT_EQ(read.serial, expected.serial);
  EXPECT_EQ(read.sample_rate_hz, expected.sample_rate_hz);
  EXPECT_EQ(read.latitude_deg, expected.latitude_deg);
  EXPECT_EQ(read.dwell_s, expected.dwell_s);
  EXPECT_EQ(read.start_time_utc, expected.start_time_utc);
  EXPECT_EQ(read.time_s, expected.time_s);
  EXPECT_EQ(read.delta_theta_rad, expected.delta_theta_rad);
  EXPECT_EQ(read.delta_v_mps, expected.delta_v_mps);
  EXPECT_EQ(read.gimbal_outer_rad, expected.gimbal_outer_rad);
  EXPECT_EQ(read.gimbal_inner_rad, expected.gimbal_inner_rad);
  EXPECT_EQ(read.temperature_c, expected.temperature_c);
  EXPECT_EQ(read.temperature_channels, expected.temperature_channels);
  EXPECT_EQ(read.schedule_deg, expected.schedule_deg);
}

TEST_F(Csv, ReadOutsThatAreNoneAreKeptSo) {
  Recording recording = test::sample_recording();
  recording.gimbal_absent = true;
  ASSERT_TRUE(write_csv(recording, folder / "none.csv"));
  const auto loaded = read_csv(folder / "none.csv");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(loaded->recording.gimbal_absent);
}

TEST_F(Csv, AcceptsCarriageReturnsOtherOrderAndExtraColumns) {
  std::string text;
  for (std::size_t at = 0; at < csv.size();) {
    const std::size_t end = csv.find('\n', at);
    text += (at == 0 ? "comment_,  " : "anything, ") + csv.substr(at, end - at) + "\r\n";
    at = end + 1;
  }
  csv = text;
  EXPECT_EQ(error(), "no error");
}

TEST_F(Csv, HeaderFaults) {
  replace(csv, "delta_v_mps_y", "delta_v_mps_q");
  EXPECT_THAT(error(), AllOf(HasSubstr("r.csv: line 1"), HasSubstr("delta_v_mps_y missing")));
  replace(csv, "delta_v_mps_q", "delta_v_mps_x");
  EXPECT_THAT(error(), HasSubstr("delta_v_mps_x appears twice"));
}

TEST_F(Csv, FieldFaultsNameLineAndColumn) {
  csv.replace(line(5), 1, "x");
  EXPECT_THAT(error(), AllOf(HasSubstr("line 5"), HasSubstr("time_s"), HasSubstr("is not a number")));
  csv.replace(line(5), 1, "0");
  csv.erase(csv.rfind(','));  // the last line loses a field
  EXPECT_THAT(error(), AllOf(HasSubstr("line 1201"), HasSubstr("10 fields where the header has 11")));
  csv += ",1,2,3";
  EXPECT_THAT(error(), HasSubstr("more than the 11 fields"));
}

TEST_F(Csv, NotANumberIsNamedByRow) {
  csv.replace(line(12), csv.find(',', line(12)) - line(12), "nan");
  EXPECT_THAT(error(), AllOf(HasSubstr("time_s: row 10"), HasSubstr("nan")));
}

TEST_F(Csv, AttributeFaultsNameLineAndKey) {
  replace(toml, "latitude_deg = 40", "latitude_deg = \"north\"");
  EXPECT_THAT(error(), AllOf(HasSubstr("r.toml:5: latitude_deg"), HasSubstr("is not a number")));
  replace(toml, "latitude_deg = \"north\"\n", "");
  EXPECT_THAT(error(), HasSubstr("latitude_deg: missing"));
  replace(toml, "version = 1", "version = 2");
  EXPECT_THAT(error(), HasSubstr("version: 2, 1 expected"));
  toml = "format = ";
  EXPECT_THAT(error(), HasSubstr("r.toml:1"));
}

TEST_F(Csv, MissingFilesAreNamed) {
  std::filesystem::remove(folder / "r.toml");
  const auto read = read_csv(folder / "r.csv");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("r.toml: cannot open"));
  EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
}

TEST_F(Csv, EmptyAndGarbage) {
  csv.clear();
  EXPECT_THAT(error(), HasSubstr("line 1: column time_s missing"));
  csv = std::string(1000, '\0');
  EXPECT_THAT(error(), HasSubstr("column time_s missing"));
}

}  // namespace
}  // namespace selfcal
