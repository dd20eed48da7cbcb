#include "protocol/recording/hdf5.hpp"

#include <gmock/gmock.h>

#include <random>

#include "protocol/recording/atomic_file.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal {
namespace {

TEST(Hdf5, ReadsBackToTheSameBits) {
  const test::TemporaryFolder folder;
  const Recording expected = test::sample_recording();
  ASSERT_TRUE(write_hdf5(expected, folder / "r.h5"));
  const auto loaded = read_hdf5(folder / "r.h5");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(loaded->warnings.empty());
  const Recording& read = loaded->recording;
  EXPECT_EQ(read.serial, expected.serial);
  EXPECT_EQ(read.sample_rate_hz, expected.sample_rate_hz);
  EXPECT_EQ(read.latitude_deg, expected.latitude_deg);
  EXPECT_EQ(read.longitude_deg, expected.longitude_deg);
  EXPECT_EQ(read.height_m, expected.height_m);
  EXPECT_EQ(read.dwell_s, expected.dwell_s);
  EXPECT_EQ(read.rotation_s, expected.rotation_s);
  EXPECT_EQ(read.start_time_utc, expected.start_time_utc);
  EXPECT_FALSE(read.gimbal_absent);
  EXPECT_EQ(read.time_s, expected.time_s);
  EXPECT_EQ(read.delta_theta_rad, expected.delta_theta_rad);
  EXPECT_EQ(read.delta_v_mps, expected.delta_v_mps);
  EXPECT_EQ(read.gimbal_outer_rad, expected.gimbal_outer_rad);
  EXPECT_EQ(read.gimbal_inner_rad, expected.gimbal_inner_rad);
  EXPECT_EQ(read.temperature_c, expected.temperature_c);
  EXPECT_EQ(read.temperature_channels, expected.temperature_channels);
  EXPECT_EQ(read.schedule_deg, expected.schedule_deg);
}

TEST(Hdf5, WithoutTheOptionalParts) {
  const test::TemporaryFolder folder;
  Recording recording = test::sample_recording();
  recording.dwell_s.reset();
  recording.rotation_s.reset();
  recording.start_time_utc.clear();
  recording.schedule_deg.clear();
  recording.temperature_c.clear();
  recording.temperature_channels = 0;
  recording.gimbal_absent = true;
  ASSERT_TRUE(write_hdf5(recording, folder / "r.h5"));
  const auto loaded = read_hdf5(folder / "r.h5");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_FALSE(loaded->recording.dwell_s);
  EXPECT_TRUE(loaded->recording.schedule_deg.empty());
  EXPECT_EQ(loaded->recording.temperature_channels, 0U);
  EXPECT_TRUE(loaded->recording.gimbal_absent);
}

TEST(Hdf5, WhatIsNoHdf5FileIsSaidSo) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(read_hdf5(folder / "absent.h5").error().message, ::testing::HasSubstr("no such file"));
  EXPECT_THAT(read_hdf5(folder.path()).error().message, ::testing::HasSubstr("not a regular file"));
  ASSERT_TRUE(write_file_atomically(folder / "text.h5", "this is no HDF5 file"));
  EXPECT_THAT(read_hdf5(folder / "text.h5").error().message, ::testing::HasSubstr("cannot read as HDF5"));
  ASSERT_TRUE(write_file_atomically(folder / "empty.h5", ""));
  EXPECT_EQ(read_hdf5(folder / "empty.h5").error().kind, ErrorKind::bad_input);
}

// A file cut off anywhere is an error; 60 places, the first kilobyte (superblock, root group) densely.
TEST(Hdf5, TruncatedAnywhereIsAnError) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_hdf5(test::sample_recording(), folder / "r.h5"));
  const std::string image = read_text_file(folder / "r.h5", 1 << 24).value();
  for (std::size_t k = 0; k < 60; ++k) {
    const std::size_t size = k < 30 ? k * 32 : image.size() * (k - 29) / 32;
    EXPECT_FALSE(read_hdf5_image(image.data(), size, "cut.h5")) << size;
  }
}

// Damaged bytes: never a crash, and what is read as sound is sound (the check ran on it).
TEST(Hdf5, DamagedBytesNeverCrash) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(write_hdf5(test::sample_recording(), folder / "r.h5"));
  const std::string image = read_text_file(folder / "r.h5", 1 << 24).value();
  std::mt19937 random(20240203);
  int refused = 0;
  constexpr int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    std::string damaged = image;
    for (int flips = 0; flips < 8; ++flips) {
      damaged[random() % damaged.size()] = static_cast<char>(random());
    }
    const auto read = read_hdf5_image(damaged.data(), damaged.size(), "damaged.h5");
    if (!read) {
      ++refused;
      EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
    } else {
      EXPECT_TRUE(check_recording(read->recording));
    }
  }
  EXPECT_GT(refused, trials / 4);  // the damage reached something that matters
}

}  // namespace
}  // namespace selfcal
