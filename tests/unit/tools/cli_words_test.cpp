// What the command line says to words and numbers that are not what they should be, through the real program.
#include <gmock/gmock.h>

#include <fstream>

#include "protocol/recording/csv.hpp"
#include "protocol/recording/hdf5.hpp"
#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using test::failure_fault;
using test::run_selfcal;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int usage = 2;
constexpr int bad_input = 3;

struct Wrong {
  std::vector<std::string> arguments;
  std::vector<std::string> named;  // what the line must hold
};

void expect_usage(const std::vector<Wrong>& all) {
  for (const Wrong& wrong : all) {
    const auto finished = run_selfcal(wrong.arguments);
    EXPECT_EQ(failure_fault(finished, usage), "") << ::testing::PrintToString(wrong.arguments) << finished.error;
    for (const std::string& word : wrong.named) {
      EXPECT_THAT(finished.error, HasSubstr(word)) << ::testing::PrintToString(wrong.arguments);
    }
    EXPECT_LT(finished.error.size(), 500U) << finished.error;
  }
}

TEST(UnknownWord, TheNearestKnownOneIsOffered) {
  const std::string out = "r.h5";
  expect_usage({
      {{"estimte", "r.h5"}, {"estimte", "did you mean estimate?"}},
      {{"help", "diagnos"}, {"diagnos", "did you mean diagnose?"}},
      {{"bus", "decdoe"}, {"decdoe", "did you mean decode?"}},
      {{"estimate", "r.h5", "--jsn"}, {"--jsn", "did you mean --json?"}},
      {{"plan", "--latitde=40"}, {"--latitde", "did you mean --latitude?"}},
      {{"plan", "--schedule", "horizonal"}, {"horizonal", "did you mean horizontal?"}},
      {{"plan", "--tolerance", "gyro_skale=3"}, {"gyro_skale", "did you mean gyro_scale?"}},
      {{"plan", "--ignore", "gyro_drft_y"}, {"gyro_drft_y", "did you mean gyro_drift_y?"}},
      {{"estimate", "r.h5", "--covariance", "carred"}, {"carred", "did you mean carried?"}},
  });
}

TEST(UnknownWord, OfAnEffectAndOfAKeyToo) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "p.toml") << "[[effect]]\nid = \"gyro_g_sensitivty\"\n";
  auto finished = run_selfcal({"simulate", "--physics", folder / "p.toml", "-o", folder / "r.h5"});
  EXPECT_EQ(failure_fault(finished, bad_input), "");
  EXPECT_THAT(finished.error, HasSubstr("did you mean gyro_g_sensitivity?"));
  std::ofstream(folder / "s.toml") << "positions = [[0, 0]]\ndwel_s = 3\n";
  finished = run_selfcal({"plan", "--schedule", folder / "s.toml"});
  EXPECT_EQ(failure_fault(finished, bad_input), "");
  EXPECT_THAT(finished.error, HasSubstr("did you mean dwell_s?"));
}

// Negative control: where nothing is near, nothing is offered.
TEST(UnknownWord, NothingNearNothingOffered) {
  EXPECT_THAT(run_selfcal({"frobnicate"}).error, Not(HasSubstr("did you mean")));
  EXPECT_THAT(run_selfcal({"plan", "--tolerance", "mass=3"}).error, Not(HasSubstr("did you mean")));
}

TEST(Help, OfTheProgramOfACommandAndOfACommandBelow) {
  const auto all = run_selfcal({"help"});
  EXPECT_EQ(all.status, 0);
  EXPECT_EQ(all.out, run_selfcal({"--help"}).out);
  EXPECT_THAT(all.out, HasSubstr("estimate"));
  EXPECT_EQ(run_selfcal({"help", "plan"}).out, run_selfcal({"plan", "--help"}).out);
  EXPECT_THAT(run_selfcal({"help", "plan"}).out, HasSubstr("--latitude"));
  EXPECT_THAT(run_selfcal({"help", "bus", "decode"}).out, HasSubstr("--request-id"));
}

TEST(Version, AsACommandAndAsAnOption) {
  const auto command = run_selfcal({"version"});
  EXPECT_EQ(command.status, 0);
  EXPECT_THAT(command.out, HasSubstr("selfcal 0."));
  EXPECT_EQ(command.out, run_selfcal({"--version"}).out);
}

TEST(Range, OfEveryKindOfNumberIsToldInAFewDigits) {
  expect_usage({
      {{"diagnose", "r.h5", "--arw", "-5"}, {"--arw -5", "outside", "deg/sqrt(h)"}},
      {{"estimate", "r.h5", "--vrw", "0"}, {"--vrw 0", "outside", "ug/sqrt(Hz)"}},
      {{"estimate", "r.h5", "--position-noise", "1e300"}, {"--position-noise 1e300", "outside", "m"}},
      {{"simulate", "--seed", "-3", "-o", "r.h5"}, {"--seed -3", "outside 0 to"}},
      {{"simulate", "--seed", "99999999999999999999", "-o", "r.h5"}, {"--seed", "outside"}},
      {{"simulate", "--seed", "three", "-o", "r.h5"}, {"--seed three", "whole number"}},
      {{"simulate", "--dwell", "-1", "-o", "r.h5"}, {"--dwell -1", "outside", " s"}},
      {{"simulate", "--rotation", "nan", "-o", "r.h5"}, {"--rotation nan", "not a number"}},
      {{"plan", "--latitude", "91"}, {"--latitude 91", "outside -89 to 89 deg"}},
      {{"plan", "--latitude", "40N"}, {"--latitude 40N", "not a number"}},
      {{"plan", "--height", "1e9"}, {"--height 1e9", "outside"}},
      {{"plan", "--attitude", "0,90"}, {"--attitude 0,90", "3 numbers"}},
      {{"plan", "--attitude", "0,90,1e4"}, {"--attitude 1e4", "outside -360 to 360 deg"}},
      {{"plan", "--longest", "1e9"}, {"--longest 1e9", "outside"}},
      {{"diagnose", "r.h5", "--false-alarm-rate", "1"}, {"--false-alarm-rate 1", "outside"}},
      {{"diagnose", "r.h5", "--gyro-lsb", "-1"}, {"--gyro-lsb -1", "outside"}},
      {{"estimate", "r.h5", "--max-passes", "100"}, {"--max-passes 100", "outside 3 to 99"}},
      {{"show", "0"}, {"RUN 0", "outside 1 to"}},
      {{"bus", "log", "can0", "--seconds", "-1"}, {"--seconds -1", "outside"}},
      {{"bus", "decode", "x", "--request-id", "64G"}, {"--request-id 64G", "hexadecimal"}},
      {{"bus", "decode", "x", "--request-id", "20000000"}, {"--request-id", "1FFFFFFF"}},
  });
}

TEST(Tolerance, OfParametersWithDifferentUnitsIsRefusedByName) {
  for (const std::string command : {"plan", "estimate"}) {
    std::vector<std::string> arguments{command, "--tolerance", "gyro=1"};
    if (command == "estimate") {
      const test::TemporaryFolder folder;
      arguments.insert(arguments.begin() + 1, folder / "absent.h5");
    }
    const auto finished = run_selfcal(arguments);
    EXPECT_EQ(failure_fault(finished, usage), "");
    for (const char* word : {"gyro_drift_x (deg/h)", "gyro_scale_x (ppm)", "gyro_misalignment_xy (arcsec)"}) {
      EXPECT_THAT(finished.error, HasSubstr(word));
    }
  }
  // One unit: a group and a single parameter are still taken.
  EXPECT_EQ(run_selfcal({"plan", "--tolerance", "gyro_scale=3", "--tolerance", "gyro_drift_x=1"}).error, "");
}

TEST(Output, EndingThatIsNotKnownIsRefusedWithThoseThatAre) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_hdf5(test::sample_recording(), folder / "a.h5"));
  expect_usage({
      {{"simulate", "-o", folder / "x.dat"}, {"x.dat", ".h5", ".csv"}},
      {{"plan", "-o", folder / "x.docx"}, {"x.docx", ".html", ".pdf", ".toml"}},
      {{"export", folder / "a.h5", "-o", folder / "y.h5"}, {"y.h5", ".csv"}},
      {{"import", folder / "a.csv", "-o", folder / "y.csv"}, {"y.csv", ".h5"}},
  });
}

TEST(Output, FolderThatDoesNotExistIsBadInputNotAnInternalError) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_hdf5(test::sample_recording(), folder / "a.h5"));
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"simulate", "-o", folder / "absent/x.h5"},
                                             {"plan", "-o", folder / "absent/x.toml"},
                                             {"export", folder / "a.h5", "-o", folder / "absent/x.csv"}}) {
    const auto finished = run_selfcal(arguments);
    EXPECT_EQ(failure_fault(finished, bad_input), "") << ::testing::PrintToString(arguments);
    EXPECT_THAT(finished.error, HasSubstr("absent"));
  }
}

TEST(Csv, ByteOrderMarkIsSkippedAndOtherSeparatorsAreToldAsWhatTheyAre) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_csv(test::sample_recording(), folder / "a.csv"));
  std::ifstream original(folder / "a.csv");
  const std::string text{std::istreambuf_iterator<char>(original), {}};
  std::ofstream(folder / "a.csv") << "\xEF\xBB\xBF" << text;
  EXPECT_EQ(run_selfcal({"import", folder / "a.csv", "-o", folder / "b.h5"}).status, 0);
  const auto read = read_hdf5(folder / "b.h5");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->recording.delta_v_mps, test::sample_recording().delta_v_mps);
  for (const auto& [separator, words] : {std::pair{';', "semicolons"}, std::pair{'\t', "tabs"}}) {
    std::string other = text;
    std::replace(other.begin(), other.end(), ',', separator);
    std::ofstream(folder / "a.csv") << other;
    const auto finished = run_selfcal({"import", folder / "a.csv", "-o", folder / "c.h5"});
    EXPECT_EQ(failure_fault(finished, bad_input), "");
    EXPECT_THAT(finished.error, HasSubstr(words));
    EXPECT_THAT(finished.error, HasSubstr("line 1"));
  }
}

// A second is 1 s of silence here; nobody sends on this group.
TEST(Monitor, OnceEndsWhereNobodySpeaks) {
  const auto finished = run_selfcal({"monitor", "--once", "--wait", "0.3", "--url", "memq://"});
  EXPECT_EQ(failure_fault(finished, 4), "") << finished.error;
  EXPECT_THAT(finished.error, HasSubstr("no message"));
}

TEST(BusLog, MissingInterfaceIsToldByName) {
  const auto finished = run_selfcal({"bus", "log", "nosuchcan0"});
  EXPECT_EQ(failure_fault(finished, 4), "");
  EXPECT_THAT(finished.error, HasSubstr("nosuchcan0"));
}

}  // namespace
}  // namespace selfcal
