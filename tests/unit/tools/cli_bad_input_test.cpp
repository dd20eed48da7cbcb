// Bad input of every kind the recording format names, through the real program: status 3, one line, the thing named.
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/csv.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using test::failure_fault;
using test::run_selfcal;
using ::testing::HasSubstr;

constexpr int usage = 2;
constexpr int bad_input = 3;

struct Fault {
  const char* name;
  std::function<void(Recording&)> put;
  std::vector<const char*> named;  // what the line must hold
  bool strict = false;             // refused only so; else it costs the part that it concerns
};

const std::vector<Fault> faults = {
    {"nan", [](Recording& r) { r.delta_theta_rad[77][1] = std::nan(""); }, {"delta_theta_rad", "row 77", "nan"}},
    {"infinity",
     [](Recording& r) { r.gimbal_outer_rad[5] = std::numeric_limits<double>::infinity(); },
     {"gimbal_outer_rad", "row 5", "inf"}},
    {"time", [](Recording& r) { std::swap(r.time_s[200], r.time_s[201]); }, {"time_s", "row 201"}},
    {"gap",
     [](Recording& r) {
       for (std::size_t k = 300; k < r.size(); ++k) {
         r.time_s[k] += 1.0;
       }
     },
     {"time_s", "row 300", "gap of 1.02 s"},
     true},
    {"rate", [](Recording& r) { r.sample_rate_hz = 200.0; }, {"sample_rate_hz = 200", "50 Hz"}},
    {"latitude", [](Recording& r) { r.latitude_deg = 91.0; }, {"latitude_deg = 91"}},
    {"longitude", [](Recording& r) { r.longitude_deg = 1e3; }, {"longitude_deg = 1000"}},
    {"height", [](Recording& r) { r.height_m = 1e6; }, {"height_m = 1000000"}},
    {"gimbal",
     [](Recording& r) {
       for (double& angle : r.gimbal_inner_rad) {
         angle = -angle;
       }
     },
     {"gimbal_inner_rad", "rows", "deg"}},
    {"unit",
     [](Recording& r) {
       for (auto& d : r.delta_v_mps) {
         for (double& c : d) {
           c *= 1000.0;
         }
       }
     },
     {"delta_v_mps"}},
};

class BadRecording : public ::testing::TestWithParam<std::size_t> {
 protected:
  test::TemporaryFolder folder;
};

TEST_P(BadRecording, OneLineAndStatusThree) {
  const Fault& fault = faults[GetParam()];
  Recording recording = test::sample_recording();
  fault.put(recording);
  ASSERT_TRUE(write_hdf5(recording, folder / "r.h5"));
  ASSERT_TRUE(write_csv(recording, folder / "r.csv"));
  for (const std::string file : {"r.h5", "r.csv"}) {
    for (const bool json : {false, true}) {
      std::vector<std::string> arguments{"estimate", folder / file};
      if (json) {
        arguments.push_back("--json");
      }
      if (fault.strict) {
        arguments.push_back("--strict");
      }
      const auto finished = run_selfcal(arguments);
      EXPECT_EQ(failure_fault(finished, bad_input), "") << file;
      for (const char* word : fault.named) {
        EXPECT_THAT(finished.error, HasSubstr(word));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Faults, BadRecording, ::testing::Range<std::size_t>(0, faults.size()),
                         [](const auto& parameter) { return std::string(faults[parameter.param].name); });

TEST(BadFile, AbsentOrNoRecordingAtAll) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(failure_fault(run_selfcal({"estimate", folder / "absent.h5"}), bad_input), "");
  EXPECT_EQ(failure_fault(run_selfcal({"estimate", folder.path()}), bad_input), "");
  ASSERT_TRUE(write_file_atomically(folder / "text.h5", "text"));
  EXPECT_EQ(failure_fault(run_selfcal({"estimate", folder / "text.h5"}), bad_input), "");
  EXPECT_EQ(failure_fault(run_selfcal({"import", folder / "absent.csv", "-o", folder / "r.h5"}), bad_input), "");
}

TEST(BadUsage, StatusTwoAndOneLine) {
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{},
                                             {"no-such-command"},
                                             {"estimate"},
                                             {"estimate", "r.h5", "--no-such-option"},
                                             {"estimate", "r.h5", "--arw", "-1"},
                                             {"estimate", "r.h5", "--covariance", "twice"},
                                             {"estimate", "r.h5", "--max-passes", "2"},
                                             {"estimate", "r.h5", "--tolerance", "gyro_scale"},
                                             {"estimate", "r.h5", "--tolerance", "gyro_skale=3"},
                                             {"simulate", "--schedule", "no-such", "-o", "r.h5"},
                                             {"simulate"}}) {
    EXPECT_EQ(failure_fault(run_selfcal(arguments), usage), "") << ::testing::PrintToString(arguments);
  }
}

TEST(BadFile, SimulationFilesNameLineAndKey) {
  const test::TemporaryFolder folder;
  const std::string out = folder / "r.h5";
  ASSERT_TRUE(write_file_atomically(folder / "s.toml", "positions = [[0, 0]]\ndwell_s = \"long\"\n"));
  auto finished = run_selfcal({"simulate", "--schedule", folder / "s.toml", "-o", out});
  EXPECT_EQ(failure_fault(finished, bad_input), "");
  EXPECT_THAT(finished.error, HasSubstr("s.toml:2: dwell_s"));
  ASSERT_TRUE(write_file_atomically(folder / "c.toml", "no_such_key = 1\n"));
  finished = run_selfcal({"simulate", "--config", folder / "c.toml", "-o", out});
  EXPECT_EQ(failure_fault(finished, bad_input), "");
  EXPECT_THAT(finished.error, HasSubstr("no_such_key"));
  EXPECT_EQ(
      failure_fault(run_selfcal({"simulate", "--schedule", "table2", "--dwell", "3", "-o", folder / "absent/r.h5"}),
                    bad_input),
      "");
}

TEST(BadFile, ReportOfADocumentWithValuesOfOtherTypes) {
  const test::TemporaryFolder folder;
  const std::string out = folder / "page.html", run = folder / "run.json", past = folder / "past.json";
  const std::string sound = R"({"run": 1, "serial": "X", "state": "completed", "started_utc": "2026-01-01T00:00:00Z",
                                "events": [], "result": {"parameters": [{"name": "gyro_drift_x", "value": 1, "sigma": 1}]}})";
  for (const char* document :
       {R"({"run": 1, "serial": 7, "state": "completed", "started_utc": "", "events": [], "result": {}})",
        R"({"run": 1, "serial": "X", "state": "completed", "started_utc": [], "events": [], "result": {}})",
        R"({"run": 1, "serial": "X", "state": "completed", "started_utc": "", "events": [], "result": {},
                                   "recording": 3})"}) {
    ASSERT_TRUE(write_file_atomically(run, document));
    const auto finished = run_selfcal({"report", run, "-o", out});
    EXPECT_EQ(failure_fault(finished, bad_input), "") << document;
    EXPECT_THAT(finished.error, HasSubstr("run.json"));
  }
  ASSERT_TRUE(write_file_atomically(run, sound));
  ASSERT_TRUE(
      write_file_atomically(past, R"({"serial": "X", "runs": 3, "parameters": [{"name": 4}, "gyro_drift_x"]})"));
  const auto beside = run_selfcal({"report", run, "--past", past, "-o", out});
  EXPECT_EQ(failure_fault(beside, bad_input), "");
  EXPECT_THAT(beside.error, HasSubstr("past.json"));
  const auto fleet = run_selfcal({"report", "--history", past, "-o", out});
  EXPECT_EQ(failure_fault(fleet, bad_input), "");
  EXPECT_THAT(fleet.error, HasSubstr("past.json"));
}

}  // namespace
}  // namespace selfcal
