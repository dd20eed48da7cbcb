// Names of columns that hold an attitude, as laboratories write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/import/guess_attitude.hpp"
#include "protocol/import/guess_names.hpp"

namespace selfcal::import {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<AttitudeColumns> of(const std::vector<std::string>& names) { return attitudes_by_name(names, {}); }

TEST(AttitudeNames, QuaternionsStandAsWXYZWhateverTheirOrder) {
  for (const auto& names :
       std::vector<std::vector<std::string>>{{"t", "qw", "qx", "qy", "qz"},
                                             {"t", "quat_w", "quat_x", "quat_y", "quat_z"},
                                             {"t", "QuatW", "QuatX", "QuatY", "QuatZ"},
                                             {"t", "orientation.w", "orientation.x", "orientation.y", "orientation.z"},
                                             {"t", "pose.q.w", "pose.q.x", "pose.q.y", "pose.q.z"}}) {
    const auto found = of(names);
    ASSERT_THAT(found, SizeIs(1)) << names[1];
    EXPECT_THAT(found[0].columns, ElementsAre(1, 2, 3, 4));
    EXPECT_TRUE(found[0].order_known);
    EXPECT_EQ(found[0].claim, AttitudeClaim::nothing);
  }
  EXPECT_THAT(of({"t", "q_x", "q_y", "q_z", "q_w"}).at(0).columns, ElementsAre(4, 1, 2, 3));
}

TEST(AttitudeNames, NumbersLeaveTheOrderOpen) {
  for (const auto& names : std::vector<std::vector<std::string>>{
           {"q0", "q1", "q2", "q3"}, {"quat1", "quat2", "quat3", "quat4"}, {"q[0]", "q[1]", "q[2]", "q[3]"}}) {
    const auto found = of(names);
    ASSERT_THAT(found, SizeIs(1)) << names[0];
    EXPECT_THAT(found[0].columns, ElementsAre(0, 1, 2, 3));
    EXPECT_FALSE(found[0].order_known);
  }
}

TEST(AttitudeNames, EurocsGroundTruthIsAReference) {
  const auto found = of({"#timestamp", " p_RS_R_x [m]", " p_RS_R_y [m]", " p_RS_R_z [m]", " q_RS_w []", " q_RS_x []",
                         " q_RS_y []", " q_RS_z []", " v_RS_R_x [m s^-1]", "b_w_RS_S_x [rad s^-1]"});
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].columns, ElementsAre(4, 5, 6, 7));
  EXPECT_EQ(found[0].claim, AttitudeClaim::reference);
}

TEST(AttitudeNames, WhoComputedItIsAClaimOfTheName) {
  const auto found = of({"vicon_qw", "vicon_qx", "vicon_qy", "vicon_qz", "ekf_q_w", "ekf_q_x", "ekf_q_y", "ekf_q_z"});
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_EQ(found[0].claim, AttitudeClaim::reference);
  EXPECT_EQ(found[1].claim, AttitudeClaim::computed);
}

TEST(AttitudeNames, MatricesAndAngles) {
  const auto matrix = of({"R11", "R12", "R13", "R21", "R22", "R23", "R31", "R32", "R33"});
  ASSERT_THAT(matrix, SizeIs(1));
  EXPECT_EQ(matrix[0].form, AttitudeForm::matrix);
  EXPECT_THAT(of({"dcm[0][0]", "dcm[0][1]", "dcm[0][2]", "dcm[1][0]", "dcm[1][1]", "dcm[1][2]", "dcm[2][0]",
                  "dcm[2][1]", "dcm[2][2]"}),
              SizeIs(1));
  const auto angles = of({"ref_yaw_deg", "ref_pitch_deg", "ref_roll_deg"});
  ASSERT_THAT(angles, SizeIs(1));
  EXPECT_EQ(angles[0].form, AttitudeForm::angles);
  EXPECT_THAT(angles[0].columns, ElementsAre(2, 1, 0));
  EXPECT_EQ(angles[0].unit, "deg");
  EXPECT_EQ(angles[0].claim, AttitudeClaim::reference);
}

TEST(AttitudeNames, SensorsAreNone) {
  EXPECT_THAT(
      of({"time", "gx", "gy", "gz", "ax", "ay", "az", "w_x", "w_y", "w_z", "roll_rate", "pitch_rate", "yaw_rate"}),
      IsEmpty());
  EXPECT_THAT(of({"qx", "qy", "qz"}), IsEmpty());  // one lacks
}

TEST(AttitudeNames, ARotationWithAWIsNoRate) {
  const auto named = read_names({"rotation.w", "rotation.x", "rotation.y", "rotation.z"}, {});
  EXPECT_EQ(named[1].role, Role::other);
}

}  // namespace
}  // namespace selfcal::import
