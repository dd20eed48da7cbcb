// The search for a rotation, with merits that can be read off a schedule.
#include "estimator/discovery/plan_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace selfcal::discovery {
namespace {

void expect_within(const Schedule& plan, const ExperimentLimits& limits) {
  ASSERT_EQ(plan.positions.size(), plan.dwell_s.size());
  EXPECT_LE(plan.duration_s(), limits.duration_s);
  EXPECT_GE(plan.rotation_s, limits.rotation_s);
  EXPECT_GE(*std::min_element(plan.dwell_s.begin(), plan.dwell_s.end()), 40.0);
  for (std::size_t k = 1; k < plan.positions.size(); ++k) {
    const GimbalPosition &a = plan.positions[k - 1], &b = plan.positions[k];
    EXPECT_LE(std::max(std::abs(a.outer_deg - b.outer_deg), std::abs(a.inner_deg - b.inner_deg)),
              limits.largest_move_deg);
  }
}

TEST(PlanSearch, EveryPlanThatIsAskedIsWithinTheLimits) {
  const ExperimentLimits limits{.duration_s = 2400.0, .largest_move_deg = 90.0, .rotation_s = 6.0};
  double shortest_s = limits.duration_s, longest_s = 0.0;
  const RatedPlan best = search_plan(limits, 0.0, [&](const Schedule& plan) {
    shortest_s = std::min(shortest_s, plan.duration_s());
    longest_s = std::max(longest_s, plan.duration_s());
    expect_within(plan, limits);
    double square = 0.0;  // no plan is worth nine tenths, so that every length is searched
    for (const double dwell : plan.dwell_s) {
      square += dwell * dwell;
    }
    return 0.5 * square / (square + 1e6);
  });
  EXPECT_LT(shortest_s, 0.25 * limits.duration_s);
  EXPECT_GT(longest_s, 0.9 * limits.duration_s);
  EXPECT_FALSE(best.plan.positions.empty());
}

// Laws of rate may need another rate of the turns, those of time since a turn dwells that differ.
TEST(PlanSearch, FindsAnotherRateAndDwellsThatDiffer) {
  const auto slow_and_varied = [](const Schedule& plan) {
    const auto [least, most] = std::minmax_element(plan.dwell_s.begin(), plan.dwell_s.end());
    return 0.5 * (plan.rotation_s >= 20.0 ? 1.0 : 0.0) + 0.5 * std::min(1.0, (*most - *least) / 90.0);
  };
  const RatedPlan best = search_plan({}, 0.0, slow_and_varied);
  EXPECT_GT(best.merit, 0.9);
  EXPECT_GE(best.plan.rotation_s, 20.0);
}

TEST(PlanSearch, NoPlanWhereNoneIsBetterThanNothing) {
  EXPECT_TRUE(search_plan({}, 0.4, [](const Schedule&) { return 0.4; }).plan.positions.empty());
}

}  // namespace
}  // namespace selfcal::discovery
