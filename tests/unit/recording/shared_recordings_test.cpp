// Recordings that another program wrote: read without an error or a warning.
#include <gmock/gmock.h>

#include "protocol/recording/hdf5.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal {
namespace {

TEST(SharedRecordings, AreAllSound) {
  const std::filesystem::path folder = test::shared_recordings();
  if (folder.empty()) {
    GTEST_SKIP() << "no recordings of another program here (SELFCAL_SHARED)";
  }
  int read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".h5") {
      const auto loaded = read_hdf5(entry.path());
      ASSERT_TRUE(loaded) << loaded.error().message;
      EXPECT_THAT(loaded->warnings, ::testing::IsEmpty()) << entry.path();
      EXPECT_GE(loaded->recording.size(), 100000U);
      EXPECT_EQ(loaded->recording.schedule_deg.size(), 19U);
      ++read;
    }
  }
  EXPECT_GE(read, 4);
}

}  // namespace
}  // namespace selfcal
