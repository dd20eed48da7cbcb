// The running estimate on data of the simulator: sigma shrinks as pages arrive, and the forecast keeps its word.
#include "daemon/estimate/running_estimate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "daemon/estimate/estimate_job.hpp"
#include "estimator/geometry/units.hpp"
#include "protocol/flash/page.hpp"
#include "sim_ins/simulate.hpp"
#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

constexpr std::uint32_t rotation = 77;
constexpr double rate_hz = 50.0;

ins::SampleFormatRecord format() {
  return {rate_hz, 1e-9, 1e-8, 2 * M_PI / flash::counts_per_turn, flash::page_bytes, flash::samples_per_page};
}

std::uint16_t gimbal_counts(double rad) {
  const double turn = rad / (2 * M_PI);
  return static_cast<std::uint16_t>(std::lround((turn - std::floor(turn)) * flash::counts_per_turn) & 0xFFFF);
}

// What an INS would have stored of this recording. Returns the number of pages.
std::uint32_t write_pages(const Recording& recording, const std::filesystem::path& folder) {
  const auto f = format();
  std::ofstream out(page_path(folder), std::ios::binary);
  std::uint32_t number = 0;
  for (std::size_t first = 0; first < recording.size(); first += flash::samples_per_page, ++number) {
    flash::Page page;
    page.run_id = rotation;
    page.sequence = number;
    page.first_sample = first;
    page.temperature_c = 25.0;
    for (std::size_t i = first; i < std::min(recording.size(), first + flash::samples_per_page); ++i) {
      flash::SampleCounts& sample = page.samples.emplace_back();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sample.delta_theta[axis] =
            static_cast<std::int32_t>(std::lround(recording.delta_theta_rad[i][axis] / f.delta_theta_lsb_rad));
        sample.delta_v[axis] =
            static_cast<std::int32_t>(std::lround(recording.delta_v_mps[i][axis] / f.delta_v_lsb_mps));
      }
      sample.outer = gimbal_counts(recording.gimbal_outer_rad[i]);
      sample.inner = gimbal_counts(recording.gimbal_inner_rad[i]);
    }
    flash::PageBytes bytes;
    flash::encode_page(page, bytes);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  return number;
}

class RunningEstimateTest : public testing::Test {
 protected:
  RunningEstimateTest() {
    schedule_ = *named_schedule("horizontal", 40.0);
    sim::SimConfig config;
    config.sample_rate_hz = rate_hz;
    recording_ = *sim::simulate(config, schedule_, 5, {});
    pages_ = write_pages(recording_, folder_);
    PageContext context;
    context.format = format();
    context.site = {config.latitude_deg, config.longitude_deg, config.height_m};
    context.pages = pages_;
    EXPECT_TRUE(write_page_context(folder_, context));
    request_.folder = folder_;
    request_.rotation = rotation;
    request_.schedule = schedule_;
  }

  std::uint32_t pages_at(double seconds) const {
    return static_cast<std::uint32_t>(seconds * rate_hz / static_cast<double>(flash::samples_per_page));
  }

  const testing_support::ScratchFolder scratch_;
  const std::filesystem::path& folder_ = scratch_.path();
  Schedule schedule_;
  Recording recording_;
  std::uint32_t pages_ = 0;
  EstimateRequest request_;
};

TEST_F(RunningEstimateTest, SigmaShrinksAsPagesArriveAndTheLastOneIsTheFinalAnswer) {
  RunningEstimator estimator(request_);
  ParameterVector before = ParameterVector::Constant(HUGE_VAL);
  RunningEstimate estimate;
  for (const double seconds : {200.0, 400.0, 600.0, schedule_.duration_s() + 10.0}) {
    auto answer = estimator.estimate(std::min(pages_, pages_at(seconds)), {});
    ASSERT_TRUE(answer) << answer.error().message;
    estimate = *answer;
    // More data never know less; the noise is estimated anew each time, to some percent.
    EXPECT_TRUE((estimate.sigma.array() <= 1.2 * before.array()).all()) << seconds;
    before = estimate.sigma;
  }
  const auto whole = estimate_job(request_)([](const CalibrationProgress&) {}, {});
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(estimate.value, whole->result.value);  // the same data through the same code
  EXPECT_EQ(estimate.sigma, whole->result.sigma);
  EXPECT_NEAR(estimate.data_s, schedule_.duration_s(), 1.0 / rate_hz);
}

TEST_F(RunningEstimateTest, TheForecastIsKept) {
  // Tolerances that this schedule reaches on its way: what all of the data give, and more by what the margin and a
  // gimbal that misses its positions by a degree take of it.
  const auto whole = estimate_job(request_)([](const CalibrationProgress&) {}, {});
  ASSERT_TRUE(whole) << whole.error().message;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    request_.config.tolerance[i] =
        1.6 * whole->result.sigma(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
  }
  RunningEstimator estimator(request_);
  const auto half = estimator.estimate(pages_at(0.5 * schedule_.duration_s()), {});
  ASSERT_TRUE(half) << half.error().message;
  EXPECT_FALSE(half->met);
  EXPECT_THAT(half->forecast.out_of_reach, testing::IsEmpty());
  const double foreseen = half->forecast.met_at_s;
  ASSERT_GT(foreseen, half->data_s);
  ASSERT_LE(foreseen, schedule_.duration_s());
  // The forecast is of the nominal positions; the gimbal misses each by up to a degree, which a position more makes up.
  const auto later = estimator.estimate(std::min(pages_, pages_at(foreseen + 45.0)), {});
  ASSERT_TRUE(later) << later.error().message;
  EXPECT_TRUE((later->sigma.array() <= later->tolerance.array()).all());
}

// "every tolerance was met", then "this schedule will not determine gyro_drift_y": a tolerance that is met, but not by
// the margin of the early end, with nothing more to come that would shrink it.
TEST_F(RunningEstimateTest, WhatIsWithinItsToleranceIsNeverOutOfReach) {
  const double data_s = schedule_.duration_s() - 45.0;
  const auto first = RunningEstimator(request_).estimate(pages_at(data_s), {});
  ASSERT_TRUE(first) << first.error().message;
  for (std::size_t i = 0; i < sensor_parameters.size(); ++i) {
    request_.config.tolerance[i] =
        1.001 * first->sigma(static_cast<Eigen::Index>(i)) / sensor_parameters[i].si_per_unit;
  }
  const auto answer = RunningEstimator(request_).estimate(pages_at(data_s), {});
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_FALSE(answer->met);
  EXPECT_THAT(answer->forecast.out_of_reach, testing::IsEmpty());
}

TEST_F(RunningEstimateTest, WhatTheScheduleCannotGiveIsNamed) {
  const auto gyro_scale_y = static_cast<std::size_t>(parameter::gyro_scale + 1);
  request_.config.tolerance[gyro_scale_y] = 1e-3;  // ppm: a thousandth of what such gyros allow in this time
  const auto answer = RunningEstimator(request_).estimate(pages_at(400), {});
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->forecast.met_at_s, -1.0);
  EXPECT_THAT(answer->forecast.out_of_reach, testing::Contains("gyro_scale_y"));
}

TEST_F(RunningEstimateTest, TooLittleDataAreAnErrorAndADamagedPageIs) {
  EXPECT_FALSE(RunningEstimator(request_).estimate(pages_at(30), {}));
  std::fstream file(page_path(folder_), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(5 * 4096 + 100);
  file.put('\x55');
  file.close();
  const auto answer = RunningEstimator(request_).estimate(pages_at(200), {});
  ASSERT_FALSE(answer);
  EXPECT_THAT(answer.error().message, testing::HasSubstr("page 5 is not what was pulled"));
}

TEST(ScheduleUntil, CutsTheLastDwellAndLeavesOutWhatWasNotReached) {
  const Schedule schedule{{{0, 0}, {90, 0}, {180, 0}}, {10, 20, 30}, 5};
  const Schedule part = schedule_until(schedule, 27);  // 10 + 5 + 12
  ASSERT_EQ(part.positions.size(), 2u);
  EXPECT_EQ(part.dwell_s, (std::vector<double>{10, 12}));
  EXPECT_EQ(part.duration_s(), 27.0);
  EXPECT_EQ(schedule_until(schedule, 12).positions.size(), 1u);  // on its way to the second
  EXPECT_EQ(schedule_until(schedule, 1000).duration_s(), schedule.duration_s());
}

}  // namespace
}  // namespace selfcal
