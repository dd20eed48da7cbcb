// selfcal plan through the real program: it warns before anything turns, and names what would do better.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "protocol/recording/atomic_file.hpp"
#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using nlohmann::json;
using test::run_selfcal;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Plan, WarnsOfTable2OnALevelBaseAndNamesTheBetterSchedule) {
  const auto finished = run_selfcal({"plan", "--schedule", "table2", "--json"});
  EXPECT_EQ(finished.status, 1);
  EXPECT_EQ(finished.error, "");
  const json document = json::parse(finished.out);
  EXPECT_FALSE(document.at("meets_tolerances").get<bool>());
  EXPECT_DOUBLE_EQ(document.at("duration_s").get<double>(), 19 * 150 + 18 * 5);
  const auto warnings = document.at("warnings").get<std::vector<std::string>>();
  for (const char* name : {"gyro_scale_y", "accel_misalignment_zx", "gyro_misalignment_xz"}) {
    EXPECT_THAT(warnings, Contains(AllOf(StartsWith(name), HasSubstr("does not meet the tolerance"))));
  }
  EXPECT_THAT(warnings, Contains(AllOf(HasSubstr("better here"), HasSubstr("'horizontal'"), HasSubstr("24 of 24"))));
  // Inner turned while it lies level: outer at 90 or 270.
  EXPECT_THAT(warnings, Contains(AllOf(HasSubstr("gyro_scale_y; supplied by extra positions"), HasSubstr("90/"))));
}

TEST(Plan, IsContentWithHorizontalOnALevelBaseAndTable2OnAPitchedOne) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"plan", "--schedule", "horizontal", "--json"},
        std::vector<std::string>{"plan", "--schedule", "table2", "--attitude", "0,90,0", "--json"}}) {
    const auto finished = run_selfcal(arguments);
    EXPECT_EQ(finished.status, 0) << finished.error;
    const json document = json::parse(finished.out);
    EXPECT_TRUE(document.at("meets_tolerances").get<bool>());
    EXPECT_TRUE(document.at("warnings").empty());
    EXPECT_EQ(document.at("parameters").size(), 24U);
  }
}

// A schedule that --optimize writes is one that plan and simulate accept, and it keeps what it promised.
TEST(Plan, OptimizedScheduleKeepsItsPromise) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> tolerances = {"--tolerance", "accel_bias=3",     "--tolerance", "gyro_drift=0.02",
                                               "--tolerance", "gyro_scale=3",     "--tolerance", "accel_scale_pos=3",
                                               "--tolerance", "accel_scale_neg=3"};
  std::vector<std::string> search = {"plan", "--optimize", "--dwell", "20", "--json", "-o", folder / "best.toml"};
  search.insert(search.end(), tolerances.begin(), tolerances.end());
  const auto found = run_selfcal(search);
  ASSERT_EQ(found.status, 0) << found.error << found.out;
  std::vector<std::string> again = {"plan", "--schedule", folder / "best.toml", "--json"};
  again.insert(again.end(), tolerances.begin(), tolerances.end());
  const auto planned = run_selfcal(again);
  ASSERT_EQ(planned.status, 0) << planned.error;
  EXPECT_EQ(json::parse(planned.out).at("parameters"), json::parse(found.out).at("parameters"));
  EXPECT_EQ(run_selfcal({"simulate", "--schedule", folder / "best.toml", "-o", folder / "r.h5"}).status, 0);
}

TEST(Plan, RefusesWhatIsNoPlan) {
  EXPECT_EQ(test::failure_fault(run_selfcal({"plan", "--schedule", "/no/such/file.toml"}), 2), "");
  EXPECT_EQ(test::failure_fault(run_selfcal({"plan", "--tolerance", "gyro_scale"}), 2), "");
  EXPECT_EQ(test::failure_fault(run_selfcal({"plan", "--ignore", "nonsense"}), 2), "");
  EXPECT_EQ(test::failure_fault(run_selfcal({"plan", "--optimize", "--longest", "5"}), 2), "");
}

}  // namespace
}  // namespace selfcal
