// Texts for people, a sample in several lines.
#include "protocol/import/repeated_lines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace selfcal::import {
namespace {

using testing::ElementsAre;

class RepeatedLines : public testing::Test {
 protected:
  std::filesystem::path written(const std::string& text) const {
    std::ofstream(path_) << text;
    return path_;
  }
  ~RepeatedLines() override { std::filesystem::remove(path_); }

 private:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() /
      ("selfcal_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".txt");
};

std::string repeated(const std::string& sample, int times) {
  std::string text;
  for (int k = 0; k < times; ++k) {
    text += sample;
  }
  return text;
}

ColumnData all_of(const ColumnSource& source) {
  ColumnRequest request;
  for (std::size_t k = 0; k < source.names().size(); ++k) {
    request.columns.push_back(k);
  }
  return *source.read(request);
}

TEST(SkeletonOf, WordsWithDigitsAndUnitsAreNoNumbers) {
  const Skeleton found = skeleton_of("MPU6050  ax: -0.19, 9.88 m/s^2\t12:00:01.5 0.98g x8004");
  EXPECT_EQ(found.text, "MPU6050 ax: #, # m/s^2 # #g x8004");
  EXPECT_THAT(found.values, ElementsAre("-0.19", "9.88", "12:00:01.5", "0.98"));
}

TEST_F(RepeatedLines, NamesAreTheWordsBeforeANumber) {
  const auto source = open_repeated_lines(
      written("MPU6050 found\n" + repeated("Accel X: 1, Y: 2, Z: 3 m/s^2\nGyro (DPS) [ 4, -5, 6 ], T: 30.5\n\n", 60)));
  ASSERT_TRUE(source.has_value());
  ASSERT_NE(*source, nullptr);
  EXPECT_THAT((*source)->names(),
              ElementsAre("Accel X", "Accel Y", "Accel Z", "Gyro (DPS)[0]", "Gyro (DPS)[1]", "Gyro (DPS)[2]", "T"));
  EXPECT_THAT((*source)->units(), ElementsAre("m/s^2", "m/s^2", "m/s^2", "", "", "", ""));
  const ColumnData data = all_of(**source);
  ASSERT_EQ(data.rows, 60U);
  EXPECT_EQ(data.values[4][59], -5.0);
}

TEST_F(RepeatedLines, SectionsStandBeforeWhatFollowsThem) {
  const auto source = open_repeated_lines(
      written(repeated("angular_velocity:\n  x: 1\n  y: 2\n  z: 3\ntemperature:\n  value: 20\n", 60)));
  ASSERT_NE(*source, nullptr);
  EXPECT_THAT((*source)->names(),
              ElementsAre("angular_velocity x", "angular_velocity y", "angular_velocity z", "temperature value"));
}

TEST_F(RepeatedLines, ASampleThatLacksALineIsLeftOut) {
  const std::string sample = "A: 1, 2, 3\nG: 4, 5, 6\n";
  const auto source = open_repeated_lines(written(repeated(sample, 40) + "A: 7, 7, 7\n" + repeated(sample, 40)));
  ASSERT_NE(*source, nullptr);
  const ColumnData data = all_of(**source);
  EXPECT_EQ(data.rows, 80U);
  EXPECT_THAT(data.values[0], testing::Each(1.0));
}

TEST_F(RepeatedLines, TextThatDoesNotRepeatIsNone) {
  std::string text;
  for (int k = 0; k < 200; ++k) {
    text += std::string(static_cast<std::size_t>(1 + k % 97), 'a') + ": 1 2 3\n";
  }
  const auto source = open_repeated_lines(written(text));
  ASSERT_TRUE(source.has_value());
  EXPECT_EQ(*source, nullptr);
}

}  // namespace
}  // namespace selfcal::import
