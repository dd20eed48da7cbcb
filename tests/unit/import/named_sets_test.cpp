// Sets of one sensor that stand side by side, by their names.
#include <gtest/gtest.h>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {
namespace {

// x, y and z of each title, '%' for the axis.
std::vector<std::string> names_of(const std::vector<std::string>& titles) {
  std::vector<std::string> names;
  for (const std::string& title : titles) {
    for (const char axis : {'x', 'y', 'z'}) {
      names.push_back(title);
      names.back()[title.find('%')] = axis;
    }
  }
  return names;
}

std::optional<std::size_t> raw_one(const std::vector<std::string>& titles) {
  const std::vector<std::string> names = names_of(titles);
  return raw_one_of(names, triads_by_name(read_names(names, {}), Role::accelerometer).all);
}

TEST(NamedSets, TheSensorsOwnIsRawOrNotWorkedOn) {
  EXPECT_EQ(raw_one({"acc_%", "acc_raw_%"}), 1U);
  EXPECT_EQ(raw_one({"raw_acc_%", "cal_acc_%", "acc_%"}), 0U);
  EXPECT_EQ(raw_one({"acc_uncalibrated_% [m/s^2]", "acc_% [m/s^2]"}), 0U);
  EXPECT_EQ(raw_one({"acc_filtered_%", "acc_%"}), 1U);
  EXPECT_EQ(raw_one({"AccelCal_%", "AccelFilt_%", "Accel_%"}), 2U);
}

TEST(NamedSets, NamesThatDoNotTellAreAsked) {
  EXPECT_FALSE(raw_one({"acc1_%", "acc2_%"}));
  EXPECT_FALSE(raw_one({"acc_raw_%", "acc2_raw_%"}));
  EXPECT_FALSE(raw_one({"acc1_%", "acc2_%", "acc_filtered_%"}));
  EXPECT_FALSE(raw_one({"acc_cal_%", "acc_filtered_%"}));
  const std::vector<std::string> one = {"acc_x", "acc_y", "acc_z", "acc_raw_x", "acc_y", "acc_z"};
  EXPECT_FALSE(raw_one_of(one, triads_by_name(read_names(one, {}), Role::accelerometer).all));
}

TEST(NamedSets, IncrementsBesideRatesAreNoSet) {
  const NamedTriads triads = triads_by_name(read_names(names_of({"gyr_%", "dtheta_%"}), {}), Role::gyro);
  EXPECT_EQ(triads.most, 1U);
  ASSERT_EQ(triads.all.size(), 1U);
  EXPECT_EQ(triads.all[0], (std::array<std::size_t, 3>{0, 1, 2}));
}

}  // namespace
}  // namespace selfcal::import
