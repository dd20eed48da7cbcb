// The positions that a plan names for an undetermined direction, tried.
#include <gmock/gmock.h>

#include "estimator/geometry/units.hpp"
#include "estimator/planning/plan.hpp"
#include "estimator/planning/remedy.hpp"

namespace selfcal {
namespace {

Installation level_base() {
  Installation installation;
  installation.attitude.heading = 30.0 * units::degree;
  installation.site.latitude = 40.0 * units::degree;
  installation.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
  installation.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
  return installation;
}

Schedule with_turn(Schedule schedule, const GimbalPosition& from, const GimbalPosition& to) {
  schedule.positions.push_back(from);
  schedule.positions.push_back(to);
  schedule.dwell_s.insert(schedule.dwell_s.end(), {30.0, 30.0});
  return schedule;
}

double sigma_along(const Plan& plan, const UndeterminedDirection& direction, const ParameterVector& tolerance) {
  const ParameterVector weight = direction.direction.cwiseQuotient(tolerance);
  return std::sqrt(weight.dot(plan.covariance * weight));
}

// Table 2 on a level base turns the inner axis only while it is vertical: two directions stay open.
TEST(Remedy, NamedTurnsDetermineTheDirection) {
  const Installation installation = level_base();
  const Schedule table2 = *named_schedule("table2");
  const Plan plan = predict(table2, installation);
  ASSERT_EQ(plan.undetermined.size(), 2U);
  for (const UndeterminedDirection& direction : plan.undetermined) {
    ASSERT_FALSE(direction.supply.empty()) << direction.words;
    for (const SupplyingTurn& turn : direction.supply) {
      // Less is known when the turn is evaluated (attitude unknown) than at the end of the schedule: a bound.
      const Plan longer = predict(with_turn(table2, turn.from, turn.to), installation);
      EXPECT_LE(sigma_along(longer, direction, installation.tolerance), turn.sigma_after) << direction.words;
      EXPECT_LE(turn.sigma_after, 1.0);
      // The axis turned must be level: outer at 90 or 270 while the inner turns. The inner alone turns here.
      EXPECT_EQ(turn.from.outer_deg, turn.to.outer_deg) << direction.words;
      EXPECT_THAT(turn.from.outer_deg, ::testing::AnyOf(90.0, 270.0)) << direction.words;
    }
  }
  // Negative control: the inner axis turned once more while it is vertical determines neither.
  const Plan vertical = predict(with_turn(table2, {0, 0}, {0, 90}), installation);
  EXPECT_GT(sigma_along(vertical, plan.undetermined[0], installation.tolerance), 1.0);
  EXPECT_GT(sigma_along(vertical, plan.undetermined[1], installation.tolerance), 1.0);
}

// Drift is angle random walk over the root of the time: no turn helps, and none is named.
TEST(Remedy, NamesNoTurnWhereOnlyTimeHelps) {
  Installation installation = level_base();
  installation.tolerance.segment<3>(parameter::gyro_drift).setConstant(0.001 * units::degree_per_hour);
  const Plan plan = predict(*named_schedule("horizontal"), installation);
  ASSERT_FALSE(plan.undetermined.empty());
  EXPECT_TRUE(plan.undetermined[0].supply.empty());
  EXPECT_THAT(plan.undetermined[0].words, ::testing::HasSubstr("dwell longer"));
}

}  // namespace
}  // namespace selfcal
