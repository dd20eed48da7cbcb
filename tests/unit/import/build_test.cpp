// A map applied to a text: numbers by hand, bits kept, faults with line and column.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <numbers>

#include "estimator/geometry/units.hpp"
#include "protocol/import/build_recording.hpp"
#include "protocol/import/guess.hpp"
#include "protocol/recording/csv.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

constexpr const char* site = "map = 1\n[site]\nlatitude_deg = 48\nlongitude_deg = 11\nheight_m = 500\n";
constexpr const char* counts = R"([recording]
sample_rate_hz = 100
[gyro]
columns = [1, 2, 3]
kind = "increments"
unit = "arcsec"
scale = [0.1, 0.2, 0.3]
zero = [10, 0, 0]
axes = ["z", "x", "-y"]
[accelerometer]
columns = [4, 5, 6]
kind = "rates"
unit = "g"
[gimbal]
fixed_deg = [0, 90]
)";

// The times of a file say the rate.
std::string without_rate() { return std::string(counts).substr(std::string_view(counts).find("[gyro]")); }

class Build : public ::testing::Test {
 protected:
  Expected<Imported> build(const std::string& text, const std::string& map) {
    std::ofstream(file_) << text;
    const auto parsed = parse_import_map(map, "lab.toml");
    if (!parsed) {
      return tl::unexpected(parsed.error());
    }
    const auto source = open_columns(file_, parsed->dialect);
    return source ? build_recording(**source, *parsed, "file.txt") : tl::unexpected(source.error());
  }
  std::string fault(const std::string& text, const std::string& map) {
    const auto built = build(text, map);
    return built ? std::string() : built.error().message;
  }
  const test::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "file.txt";
};

TEST_F(Build, CountsAxesAndNoTime) {
  const auto built = build("11 2 3 0 0 1\n10 0 -1 1 0 0\n", std::string(site) + counts);
  ASSERT_TRUE(built) << built.error().message;
  const Recording& r = built->recording;
  EXPECT_EQ(r.time_s, (std::vector<double>{0.01, 0.02}));
  // x of b from the third column, y from the first, z from the second reversed.
  EXPECT_DOUBLE_EQ(r.delta_theta_rad[0][0], 0.9 * units::arcsecond);
  EXPECT_DOUBLE_EQ(r.delta_theta_rad[0][1], 0.1 * units::arcsecond);
  EXPECT_DOUBLE_EQ(r.delta_theta_rad[0][2], -0.4 * units::arcsecond);
  EXPECT_DOUBLE_EQ(r.delta_v_mps[0][2], 9.80665 * 0.01);
  EXPECT_DOUBLE_EQ(r.gimbal_inner_rad[1], std::numbers::pi / 2);
}

TEST_F(Build, NanosecondsSince1970AreExact) {
  const std::string map =
      std::string(site) + "[time]\ncolumn = 7\nunit = \"ns\"\norigin = \"first\"\n" + without_rate();
  const auto built =
      build("0,0,0,0,0,1,1709164800000000000\n0,0,0,0,0,1,1709164800010000000\n0,0,0,0,0,1,1709164800020000000\n", map);
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_EQ(built->recording.sample_rate_hz, 100.0);
  EXPECT_NEAR(built->recording.time_s[0], 0.01, 1e-9);
  EXPECT_NEAR(built->recording.time_s[2], 0.03, 1e-9);
}

TEST_F(Build, OwnCsvByAMapGivesTheSameBits) {
  const Recording expected = test::sample_recording();
  ASSERT_TRUE(write_csv(expected, folder_ / "own.csv"));
  const std::string map = std::string(site) + R"([recording]
sample_rate_hz = 50
[time]
column = "time_s"
[gyro]
columns = ["delta_theta_rad_x", "delta_theta_rad_y", "delta_theta_rad_z"]
kind = "increments"
unit = "rad"
[accelerometer]
columns = ["delta_v_mps_x", "delta_v_mps_y", "delta_v_mps_z"]
kind = "increments"
unit = "m/s"
[gimbal]
outer = "gimbal_outer_rad"
inner = "gimbal_inner_rad"
unit = "rad"
[temperature]
columns = ["temperature_c_0"]
)";
  const auto parsed = parse_import_map(map, "lab.toml");
  ASSERT_TRUE(parsed) << parsed.error().message;
  const auto source = open_columns(folder_ / "own.csv");
  ASSERT_TRUE(source) << source.error().message;
  const auto built = build_recording(**source, *parsed, "own.csv");
  ASSERT_TRUE(built) << built.error().message;
  EXPECT_EQ(built->recording.time_s, expected.time_s);
  EXPECT_EQ(built->recording.delta_theta_rad, expected.delta_theta_rad);
  EXPECT_EQ(built->recording.delta_v_mps, expected.delta_v_mps);
  EXPECT_EQ(built->recording.gimbal_outer_rad, expected.gimbal_outer_rad);
  EXPECT_EQ(built->recording.gimbal_inner_rad, expected.gimbal_inner_rad);
}

// A table with one axis: what it does not have stands still, and that is said.
TEST_F(Build, OneReadOutIsEnough) {
  const std::string sensors(counts, std::string_view(counts).find("[gimbal]"));
  for (const bool outer : {true, false}) {
    const std::string map = std::string(site) + sensors + "[gimbal]\n" + (outer ? "outer" : "inner") + " = 7\n";
    const auto built = build("0 0 0 0 0 1 10\n0 0 0 0 0 1 20\n", map);
    ASSERT_TRUE(built) << built.error().message;
    const Recording& r = built->recording;
    const std::vector<double>& turned = outer ? r.gimbal_outer_rad : r.gimbal_inner_rad;
    ASSERT_EQ(turned.size(), 2u);
    EXPECT_DOUBLE_EQ(turned[1], 20.0 * units::degree);
    EXPECT_EQ(outer ? r.gimbal_inner_rad : r.gimbal_outer_rad, std::vector<double>(2, 0.0));
    EXPECT_THAT(built->notes, ::testing::Contains(::testing::HasSubstr("one read-out")));
  }
}

// Jitter of half an interval either way: the sums are those of before, the intervals are even.
TEST_F(Build, ResamplesOnlyWhenAskedAndSaysSo) {
  std::string text;
  for (int k = 1; k <= 200; ++k) {
    text += fmt::format("{} 2 3 0 0 1 {}\n", k, 0.01 * k + (k % 2 == 0 ? 0.002 : 0.0));
  }
  const auto map = [](const char* resample) {
    return std::string(site) + "[time]\ncolumn = 7\nresample = " + resample + "\n" + counts;
  };
  const auto plain = build(text, map("false"));
  const auto even = build(text, map("true"));
  ASSERT_TRUE(plain && even) << (plain ? even.error().message : plain.error().message);
  EXPECT_NEAR(plain->recording.time_s[1] - plain->recording.time_s[0], 0.012, 1e-12);
  double total = 0.0;
  for (std::size_t k = 0; k < even->recording.size(); ++k) {
    total += even->recording.delta_theta_rad[k][0];
    EXPECT_NEAR(even->recording.time_s[k], 0.01 * static_cast<double>(k + 1), 1e-9);
  }
  // Third column, 0.3 arcsec a count, three counts a sample; the last 2 ms lie beyond the grid.
  EXPECT_NEAR(total / (0.9 * units::arcsecond), 200.0, 0.2);
  EXPECT_THAT(even->notes, ::testing::Contains(HasSubstr("resampled: 200 samples onto 200")));
  EXPECT_THAT(plain->notes, ::testing::Contains(HasSubstr("not resampled")));
}

TEST_F(Build, FaultsNameLineColumnAndWhatIsExpected) {
  const std::string map = std::string(site) + counts;
  EXPECT_EQ(fault("1 2 3 0 0 1\n1 2 x 0 0 1\n", map + "\n[text]\nseparator = \"blank\"\n"),
            (folder_ / "file.txt").string() + ": line 2: column 3: \"x\"; a number is expected");
  EXPECT_THAT(fault("1 2 3 0 0 1\n1 2 nan 0 0 1\n", map + "\n[text]\nseparator = \"blank\"\n"),
              HasSubstr("line 2: column 3: \"nan\"; a finite"));
  EXPECT_THAT(fault("1 2 3 0 0 1\n1 2 3 0 0\n", map + "\n[text]\nseparator = \"blank\"\n"),
              HasSubstr("line 2: 5 fields; column 6 is wanted"));
  EXPECT_THAT(fault("1 2 3\n1 2 3\n", map), HasSubstr("lab.toml:16: accelerometer.columns: column 4; the file has 3"));
  const std::string timed = std::string(site) + "[time]\ncolumn = 7\n" + counts;
  EXPECT_THAT(fault("1 2 3 0 0 1 0.1\n\n# a remark\n1 2 3 0 0 1 0.1\n", timed),
              HasSubstr("line 4: time 0.1 is not after 0.1"));
}

// Thirty samples at 100 Hz, the sixth and seventh without one number, the last cut off.
std::string with_lost_lines() {
  std::string text = "# a remark\n";
  for (int k = 1; k < 30; ++k) {
    text += fmt::format("1 2 3 0 {} 1 {:.2f}\n", k == 6 || k == 7 ? "NaN" : "0", 0.01 * k);
    text += k == 3 ? "\n" : "";
  }
  return text + "1 2 3 0 0";
}

TEST_F(Build, LinesThatLackANumberAreLostSamplesWhereTheMapSaysSo) {
  const std::string strict = std::string(site) + "[time]\ncolumn = 7\n" + without_rate();
  EXPECT_THAT(fault(with_lost_lines(), strict), HasSubstr("line 8: column 5: \"NaN\"; a finite number is expected"));
  const std::string map = std::string(site) + "[time]\ncolumn = 7\nleave_out_incomplete = true\n" + without_rate();
  const auto built = build(with_lost_lines(), map);
  ASSERT_TRUE(built) << built.error().message;
  ASSERT_EQ(built->recording.time_s.size(), 27U);
  EXPECT_EQ(built->recording.sample_rate_hz, 100.0);
  EXPECT_NEAR(built->recording.time_s[4], 0.05, 1e-12);
  EXPECT_NEAR(built->recording.time_s[5], 0.08, 1e-12);  // a gap, as lost samples leave it
  EXPECT_THAT(
      built->notes,
      testing::Contains(HasSubstr("3 lines lack a number and are left out as lost samples, the first at line 8")));
  // Lines behind those left out keep their numbers.
  std::string back = with_lost_lines();
  back.replace(back.find("0.20"), 4, "0.10");
  EXPECT_THAT(fault(back, map), HasSubstr("line 22: time 0.1 is not after 0.19"));
  EXPECT_THAT(fault("1 2 3 0 0 1 0.01\n1 2 3 0 0 NaN 0.02\n1 2 3 0 0 1 0.03\n", map),
              HasSubstr("1 of 3 lines lack a number"));
  EXPECT_THAT(fault(with_lost_lines(), std::string(site) + "[time]\nleave_out_incomplete = true\n" + counts),
              HasSubstr("time.leave_out_incomplete"));
}

// A sensor at rest at 100 Hz, its last line cut off.
TEST_F(Build, TheGuessLeavesOutLinesThatLackANumber) {
  const auto text = [](int lost) {
    std::string all = "time,gx,gy,gz,ax,ay,az\n";
    for (int k = 1; k <= 2000; ++k) {
      const bool bad = k > 700 && k <= 700 + lost;
      all += bad ? fmt::format("{:.2f},nan,nan,nan,nan,nan,nan\n", 0.01 * k)
                 : fmt::format("{:.2f},0.001,-0.002,0.0005,0.{},0.2,9.8\n", 0.01 * k, 10 + k % 7);
    }
    return all + "20.01,0.0";
  };
  const auto guessed = [&](const std::string& file) {
    std::ofstream(file_) << file;
    const auto source = open_columns(file_);
    return source ? guess_map(**source, {}, "file.txt") : tl::unexpected(source.error());
  };
  const auto guess = guessed(text(12));
  ASSERT_TRUE(guess) << guess.error().message;
  EXPECT_TRUE(guess->map.time.leave_out_incomplete);
  ASSERT_TRUE(guess->map.time.column);
  EXPECT_EQ(guess->map.accelerometer.columns[2].name, "az");
  EXPECT_EQ(guess->map.sample_rate_hz, 100.0);
  const auto said = std::find_if(guess->remarks.begin(), guess->remarks.end(),
                                 [](const Remark& r) { return r.key == "time.leave_out_incomplete"; });
  ASSERT_NE(said, guess->remarks.end());
  EXPECT_THAT(said->text, HasSubstr("13 of 2001 lines"));
  EXPECT_TRUE(parse_import_map(format_import_map(guess->map, {}, ""), "map")->time.leave_out_incomplete);
  // What lacks more than a hundredth is no sensor's.
  const auto many = guessed(text(100));
  ASSERT_TRUE(many) << many.error().message;
  EXPECT_TRUE(many->map.accelerometer.columns[2].name.empty());
}

TEST_F(Build, DoubtsAndAMissingSiteWriteNothing) {
  const std::string text = "1 2 3 0 0 1\n1 2 3 0 0 1\n";
  EXPECT_THAT(fault(text, "unsettled = [\"gyro.axes\"]\n" + std::string(site) + counts),
              HasSubstr("lab.toml:1: unsettled: gyro.axes: say what is right"));
  EXPECT_THAT(fault(text, std::string("map = 1\n") + counts), HasSubstr("site.latitude_deg: missing"));
}

}  // namespace
}  // namespace selfcal::import
