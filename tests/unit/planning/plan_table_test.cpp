// predict() against the published table of the physical limit, entry by entry, within 3 %.
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include "estimator/geometry/units.hpp"
#include "estimator/planning/plan.hpp"
#include "tests/unit/planning/limit_table.hpp"

namespace selfcal {
namespace {

constexpr double allowed = 0.03;

Plan plan_of(const test::LimitRow& row, double noise_factor) {
  Installation installation;
  installation.attitude = {0.0, row.pitch_deg * units::degree, 30.0 * units::degree};
  installation.site.latitude = 40.0 * units::degree;
  installation.gyro_arw = noise_factor * row.arw_deg_per_sqrt_h * units::degree_per_sqrt_hour;
  installation.accel_vrw = noise_factor * row.vrw_ug * units::micro_g_per_sqrt_hz;
  installation.position_sigma = noise_factor * row.position_m;
  return predict(*named_schedule(row.schedule, row.dwell_s), installation);
}

class Limit : public ::testing::TestWithParam<test::LimitRow> {};

TEST_P(Limit, IsWhatThePlanPredicts) { test::expect_limit(GetParam(), plan_of(GetParam(), 1.0).sigma, allowed); }

INSTANTIATE_TEST_SUITE_P(Table, Limit, ::testing::ValuesIn(test::limit_table()),
                         [](const auto& row) { return row.param.name; });

// Negative control: all noise, and so all sigmas, ten per cent up.
TEST(Limit, IsMissedWithTenPerCentMoreNoise) {
  for (const char* name : {"table2_pitch90", "horizontal_level", "horizontal_60_s", "horizontal_10_um"}) {
    testing::TestPartResultArray failures;
    {
      const testing::ScopedFakeTestPartResultReporter reporter(
          testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &failures);
      test::expect_limit(test::limit_row(name), plan_of(test::limit_row(name), 1.1).sigma, allowed);
    }
    EXPECT_GT(failures.size(), 0) << name;
  }
}

}  // namespace
}  // namespace selfcal
