// selfcal import, export and simulate through the real program.
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
