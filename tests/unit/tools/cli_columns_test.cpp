// Which columns of a log `selfcal poses` reads, through the real program.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <random>

#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using test::failure_fault;
using test::run_selfcal;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int bad_input = 3;

// A minute at rest: columns that a name begins with 'a' read 1 g in z, others noise alone.
void write_rest(const std::string& path, const std::vector<std::string>& names) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::ofstream file(path);
  file << fmt::format("t_s,{}\n", fmt::join(names, ","));
  for (int row = 0; row < 6000; ++row) {
    file << fmt::format("{:.2f}", 0.01 * row);
    for (const std::string& name : names) {
      const bool up = name.front() == 'a' && name.find('z') != std::string::npos;
      file << fmt::format(",{:.6f}", (up ? 1.0 : 0.0) + 1e-3 * normal(random));
    }
    file << "\n";
  }
}

class PosesColumns : public ::testing::Test {
 protected:
  test::Finished poses(const std::vector<std::string>& names, std::vector<std::string> arguments = {}) {
    const std::string log = folder_ / "log.csv";
    write_rest(log, names);
    arguments.insert(arguments.begin(), {"poses", log});
    return run_selfcal(arguments);
  }
  test::TemporaryFolder folder_;
};

TEST_F(PosesColumns, OfAPlanarModuleTheGyroIsAnswered) {
  const auto planar = poses({"ax_g", "ay_g", "gz_dps"});
  EXPECT_EQ(planar.status, 0) << planar.error;
  EXPECT_THAT(planar.error, HasSubstr("column 2 (ax_g), column 3 (ay_g): left alone"));
  EXPECT_THAT(planar.error, HasSubstr("the one gyro is column 4, taken for z"));
  EXPECT_THAT(planar.out, HasSubstr("accelerometers; the Earth's rate"));
  const auto three = poses({"ax_g", "ay_g", "az_g", "gz_dps"});
  EXPECT_THAT(three.error, HasSubstr("column 5 (gz_dps): left alone"));
  const auto one = poses({"ax_g", "ay_g", "az_g", "gz_dps"}, {"--only", "gyros"});
  EXPECT_EQ(one.status, 0) << one.error;
  EXPECT_THAT(one.error, Not(HasSubstr("left alone")));
  for (const auto& names : {std::vector<std::string>{"ax_g", "ay_g"}, {"ax_g", "ay_g", "gx_dps", "gy_dps"}}) {
    const auto neither = poses(names);
    EXPECT_EQ(failure_fault(neither, bad_input), "");
    EXPECT_THAT(neither.error, HasSubstr("no x, y and z of either"));
  }
}

// "Timestamp" 0, 1, 2: a second, or rows that were counted. Those since 1970 are seconds.
TEST_F(PosesColumns, ATimeThatOnlyCountsRowsIsAskedFor) {
  for (const long begin : {0L, 1700000000L}) {
    const std::string log = folder_ / "counted.csv";
    std::ofstream file(log);
    file << "Timestamp,acc_x_g,acc_y_g,acc_z_g,gyr_x_dps,gyr_y_dps,gyr_z_dps\n";
    for (int row = 0; row < 400; ++row) {
      file << fmt::format("{},0.01,0.02,{:.3f},0.1,{:.2f},0.3\n", begin + row, 1.0 + 1e-3 * (row % 7),
                          0.01 * (row % 5));
    }
    file.close();
    const auto read = run_selfcal({"poses", log});
    EXPECT_EQ(read.error.find("rows that are counted") != std::string::npos, begin == 0) << read.error;
    const auto told = run_selfcal({"poses", log, "--rate", "100"});
    EXPECT_THAT(told.error, Not(HasSubstr("rows that are counted")));
  }
}

TEST_F(PosesColumns, OfSeveralSetsTheRawOneOrThatWhichIsListed) {
  const std::vector<std::string> sets = {"ax_g", "ay_g", "az_g", "a_raw_x", "a_raw_y", "a_raw_z"};
  const auto raw = poses(sets);
  EXPECT_EQ(raw.status, 0) << raw.error;
  EXPECT_THAT(raw.error, HasSubstr("of 2 sets of accelerometers what the sensor itself gives"));
  EXPECT_THAT(raw.error, HasSubstr("accelerometers 5, 6, 7"));
  const auto listed = poses(sets, {"--accelerometer-columns", "ax_g, ay_g, 4"});
  EXPECT_EQ(listed.status, 0) << listed.error;
  EXPECT_THAT(listed.error, Not(HasSubstr("sets")));
  const auto asked = poses({"acc1_x", "acc1_y", "acc1_z", "acc2_x", "acc2_y", "acc2_z"});
  EXPECT_EQ(failure_fault(asked, bad_input), "");
  EXPECT_THAT(asked.error, HasSubstr("--accelerometer-columns says which"));
  const auto unread = poses({"c1", "c2", "c3", "ab1", "ab2", "abz"});
  EXPECT_THAT(unread.error, HasSubstr("no name says what the columns are, in their order time is column 1"));
  const auto wrong = poses(sets, {"--accelerometer-columns", "2,3,9"});
  EXPECT_EQ(failure_fault(wrong, bad_input), "");
  EXPECT_THAT(wrong.error, HasSubstr("'9' is none of its 7 columns"));
}

}  // namespace
}  // namespace selfcal
