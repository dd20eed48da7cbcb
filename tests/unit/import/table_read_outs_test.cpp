// Columns that a table wrote, by their names; the angle of a rate.
#include "protocol/import/table_read_outs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace selfcal::import {
namespace {

TableReadOut of(const std::string& name) { return table_read_out(read_name(name, ""), name); }

TEST(TableReadOut, AnglesAndRatesOfATable) {
  for (const char* name : {"cmd_top_pitch_deg", "table_pos_deg", "encoder_rad", "outer", "TableAngle", "axis1_angle"}) {
    EXPECT_EQ(of(name), TableReadOut::angle) << name;
  }
  for (const char* name : {"table_rate_dps", "cmd_rate", "turntable_speed (rpm)", "setpoint_rate [deg/s]"}) {
    EXPECT_EQ(of(name), TableReadOut::rate) << name;
  }
}

TEST(TableReadOut, WhatIsNone) {
  for (const char* name : {"pitch", "yaw_deg", "gz_dps", "axis", "encoder_counts", "motor_current", "cmd_throttle",
                           "sample_rate", "stable_angle", "cmd_acc_x"}) {
    EXPECT_EQ(of(name), TableReadOut::none) << name;
  }
}

TEST(AngleOfRate, IsExactForARateThatRisesEvenly) {
  EXPECT_THAT(angle_of_rate({0.0, 1.0, 2.0, 2.0}, {0.0, 1.0, 2.0, 4.0}), testing::ElementsAre(0.0, 0.5, 2.0, 6.0));
}

}  // namespace
}  // namespace selfcal::import
