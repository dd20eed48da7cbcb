// selfcal import, export and simulate through the real program.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "protocol/recording/hdf5.hpp"
#include "tests/unit/recording/sample_recording.hpp"
#include "tests/unit/tools/program.hpp"

namespace selfcal {
namespace {

using test::run_selfcal;

TEST(Convert, ThereAndBackGivesTheSameBits) {
  const test::TemporaryFolder folder;
  const Recording expected = test::sample_recording();
  ASSERT_TRUE(write_hdf5(expected, folder / "a.h5"));
  const auto exported = run_selfcal({"export", folder / "a.h5", "-o", folder / "b.csv"});
  EXPECT_EQ(exported.status, 0) << exported.error;
  const auto imported = run_selfcal({"import", folder / "b.csv", "-o", folder / "c.h5"});
  EXPECT_EQ(imported.status, 0) << imported.error;
  const auto read = read_hdf5(folder / "c.h5");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->recording.delta_theta_rad, expected.delta_theta_rad);
  EXPECT_EQ(read->recording.delta_v_mps, expected.delta_v_mps);
  EXPECT_EQ(read->recording.temperature_c, expected.temperature_c);
  EXPECT_EQ(read->recording.serial, expected.serial);
}

TEST(Convert, ByAGuessWithoutDoubtsTheSameBits) {
  const test::TemporaryFolder folder;
  const auto made =
      run_selfcal({"simulate", "--schedule", "horizontal", "--dwell", "6", "--seed", "3", "-o", folder / "a.h5"});
  ASSERT_EQ(made.status, 0) << made.error;
  ASSERT_EQ(run_selfcal({"export", folder / "a.h5", "-o", folder / "b.csv"}).status, 0);
  const auto expected = read_hdf5(folder / "a.h5");
  ASSERT_TRUE(expected);
  const auto guessed = run_selfcal({"import", folder / "b.csv", "--guess", "--map", folder / "b.map.toml", "--latitude",
                                    fmt::format("{}", expected->recording.latitude_deg), "--longitude",
                                    fmt::format("{}", expected->recording.longitude_deg), "--height",
                                    fmt::format("{}", expected->recording.height_m), "-o", folder / "c.h5"});
  ASSERT_EQ(guessed.status, 0) << guessed.error << guessed.out;
  const auto read = read_hdf5(folder / "c.h5");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->recording.time_s, expected->recording.time_s);
  EXPECT_EQ(read->recording.delta_theta_rad, expected->recording.delta_theta_rad);
  EXPECT_EQ(read->recording.delta_v_mps, expected->recording.delta_v_mps);
  EXPECT_EQ(read->recording.gimbal_outer_rad, expected->recording.gimbal_outer_rad);
  EXPECT_EQ(read->recording.gimbal_inner_rad, expected->recording.gimbal_inner_rad);
  EXPECT_EQ(read->recording.temperature_c, expected->recording.temperature_c);
  EXPECT_EQ(read->recording.sample_rate_hz, expected->recording.sample_rate_hz);
  // A guess does not overwrite what somebody may have mended.
  const auto again = run_selfcal({"import", folder / "b.csv", "--guess", "--map", folder / "b.map.toml"});
  EXPECT_EQ(test::failure_fault(again, 2), "") << again.error;
}

TEST(Convert, ADoubtedMapIsRefusedAndNothingIsWritten) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(run_selfcal({"simulate", "--schedule", "horizontal", "--dwell", "4", "-o", folder / "a.h5"}).status, 0);
  ASSERT_EQ(run_selfcal({"export", folder / "a.h5", "-o", folder / "b.csv"}).status, 0);
  const auto guessed =
      run_selfcal({"import", folder / "b.csv", "--guess", "--map", folder / "m.toml", "-o", folder / "c.h5"});
  EXPECT_EQ(guessed.status, 1) << guessed.error;  // the site is not in the file
  const auto refused = run_selfcal({"import", folder / "b.csv", "--map", folder / "m.toml", "-o", folder / "c.h5"});
  EXPECT_EQ(test::failure_fault(refused, 3), "") << refused.error;
  EXPECT_THAT(refused.error, ::testing::HasSubstr("unsettled: site"));
  EXPECT_FALSE(std::filesystem::exists(folder / "c.h5"));
}

TEST(Simulate, SameSeedSameBitsAndAnotherSeedOthers) {
  const test::TemporaryFolder folder;
  const auto simulate = [&](const std::string& seed, const std::string& file) {
    const auto finished =
        run_selfcal({"simulate", "--schedule", "horizontal", "--dwell", "4", "--seed", seed, "-o", folder / file});
    EXPECT_EQ(finished.status, 0) << finished.error;
    EXPECT_EQ(finished.error, "");
    auto read = read_hdf5(folder / file);
    EXPECT_TRUE(read) << (read ? "" : read.error().message);
    return read ? std::move(read->recording) : Recording{};
  };
  const Recording first = simulate("7", "a.h5");
  EXPECT_EQ(first.size(), static_cast<std::size_t>((19 * 4 + 18 * 5) * 200));
  EXPECT_EQ(first.delta_theta_rad, simulate("7", "b.h5").delta_theta_rad);
  EXPECT_NE(first.delta_theta_rad, simulate("8", "c.h5").delta_theta_rad);
}

}  // namespace
}  // namespace selfcal
