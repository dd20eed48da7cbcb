// selfcal estimate through the real program: the JSON document of the interface, statuses, and the truth of recordings
// that another program wrote.
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/recording/atomic_file.hpp"
#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using nlohmann::json;
using test::run_selfcal;

// tools/handbook/parameters.md, written out: the program's own table must not be its own witness.
const std::vector<std::pair<std::string, std::string>> names_and_units = {{"accel_bias_x", "ug"},
                                                                          {"accel_bias_y", "ug"},
                                                                          {"accel_bias_z", "ug"},
                                                                          {"gyro_drift_x", "deg/h"},
                                                                          {"gyro_drift_y", "deg/h"},
                                                                          {"gyro_drift_z", "deg/h"},
                                                                          {"accel_scale_pos_x", "ppm"},
                                                                          {"accel_scale_pos_y", "ppm"},
                                                                          {"accel_scale_pos_z", "ppm"},
                                                                          {"accel_scale_neg_x", "ppm"},
                                                                          {"accel_scale_neg_y", "ppm"},
                                                                          {"accel_scale_neg_z", "ppm"},
                                                                          {"accel_misalignment_yx", "arcsec"},
                                                                          {"accel_misalignment_zx", "arcsec"},
                                                                          {"accel_misalignment_zy", "arcsec"},
                                                                          {"gyro_scale_x", "ppm"},
                                                                          {"gyro_scale_y", "ppm"},
                                                                          {"gyro_scale_z", "ppm"},
                                                                          {"gyro_misalignment_xy", "arcsec"},
                                                                          {"gyro_misalignment_xz", "arcsec"},
                                                                          {"gyro_misalignment_yx", "arcsec"},
                                                                          {"gyro_misalignment_yz", "arcsec"},
                                                                          {"gyro_misalignment_zx", "arcsec"},
                                                                          {"gyro_misalignment_zy", "arcsec"}};

std::vector<double> truth_of(const std::filesystem::path& file) {
  const json truth = json::parse(read_text_file(file, 1 << 20).value());
  std::vector<double> values;
  for (const char* group : {"ba", "bg", "kp", "km", "A", "kg", "G"}) {
    for (const json& value : truth.at("par").at(group)) {
      values.push_back(value.get<double>());
    }
  }
  return values;
}

TEST(Estimate, JsonIsTheDocumentOfTheInterface) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(run_selfcal({"simulate", "--schedule", "horizontal", "--dwell", "30", "-o", folder / "r.h5"}).status, 0);
  const auto finished = run_selfcal({"estimate", "--json", folder / "r.h5"});
  EXPECT_THAT(finished.status, ::testing::AnyOf(0, 1));
  EXPECT_EQ(finished.error, "");
  const json document = json::parse(finished.out);  // throws, and so fails, on anything but one document
  ASSERT_EQ(document.at("parameters").size(), names_and_units.size());
  bool all_determined = true;
  for (std::size_t k = 0; k < names_and_units.size(); ++k) {
    const json& parameter = document.at("parameters")[k];
    EXPECT_EQ(parameter.at("name"), names_and_units[k].first);
    EXPECT_EQ(parameter.at("unit"), names_and_units[k].second);
    EXPECT_TRUE(std::isfinite(parameter.at("value").get<double>()));
    EXPECT_GT(parameter.at("sigma").get<double>(), 0.0);
    all_determined = all_determined && parameter.at("determined").get<bool>();
  }
  EXPECT_EQ(finished.status == 0, document.at("acceptable").get<bool>());
  EXPECT_TRUE(all_determined || finished.status == 1);
  for (const char* angle : {"roll", "pitch", "heading"}) {
    EXPECT_TRUE(document.at("initial_attitude_deg").at(angle).is_number());
  }
  ASSERT_GE(document.at("passes").size(), 3U);
  EXPECT_EQ(document.at("passes")[0].at("direction"), "forward");
  EXPECT_EQ(document.at("passes")[1].at("direction"), "reverse");
  EXPECT_EQ(document.at("samples"), (19 * 30 + 18 * 5) * 200);
  EXPECT_NEAR(document.at("duration_s").get<double>(), 19 * 30 + 18 * 5, 1e-6);
  EXPECT_GT(document.at("elapsed_s").get<double>(), 0.0);
}

TEST(Estimate, ToleranceDecidesWhatIsDetermined) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(run_selfcal({"simulate", "--schedule", "horizontal", "--dwell", "30", "-o", folder / "r.h5"}).status, 0);
  const auto finished = run_selfcal(
      {"estimate", "--json", folder / "r.h5", "--tolerance", "gyro_scale=0.001", "--tolerance", "gyro_drift=1"});
  EXPECT_EQ(finished.status, 1);
  const json document = json::parse(finished.out);
  for (const json& parameter : document.at("parameters")) {
    const std::string name = parameter.at("name");
    if (name.starts_with("gyro_scale")) {
      EXPECT_FALSE(parameter.at("determined").get<bool>()) << name;
    }
    if (name.starts_with("gyro_drift")) {
      EXPECT_TRUE(parameter.at("determined").get<bool>()) << name;
    }
  }
}

struct Known {
  const char* name;
  int status;
  std::vector<std::string> undetermined;
};

class KnownRecording : public ::testing::TestWithParam<Known> {};

// Four sigma: one false alarm in 16000 parameters.
TEST_P(KnownRecording, WithinFourSigmaOfTheTruth) {
  const std::filesystem::path folder = test::shared_recordings();
  if (folder.empty()) {
    GTEST_SKIP() << "no recordings of another program here (SELFCAL_SHARED)";
  }
  const std::string stem = std::string("known-") + GetParam().name;
  const auto finished = run_selfcal({"estimate", "--json", folder / (stem + ".h5")});
  EXPECT_EQ(finished.status, GetParam().status) << finished.error;
  const json document = json::parse(finished.out);
  const std::vector<double> truth = truth_of(folder / (stem + ".truth.json"));
  ASSERT_EQ(truth.size(), document.at("parameters").size());
  std::vector<std::string> undetermined;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const json& parameter = document.at("parameters")[k];
    EXPECT_LE(std::abs(parameter.at("value").get<double>() - truth[k]), 4.0 * parameter.at("sigma").get<double>())
        << parameter << " truth " << truth[k];
    if (!parameter.at("determined").get<bool>()) {
      undetermined.push_back(parameter.at("name"));
    }
  }
  EXPECT_EQ(undetermined, GetParam().undetermined);
}

INSTANTIATE_TEST_SUITE_P(Recordings, KnownRecording,
                         ::testing::Values(Known{"table3-horizontal-level", 0, {}},
                                           Known{"table5-table2-pitch90", 0, {}},
                                           Known{"table5-horizontal-moored", 0, {}},
                                           Known{"table5-table2-level",
                                                 1,
                                                 {"accel_misalignment_zx", "gyro_scale_y", "gyro_misalignment_xz"}}),
                         [](const auto& parameter) {
                           std::string name = parameter.param.name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace selfcal
