// The progress line of `selfcal run`: never wider than asked for, one clock, the most important parts first.
#include "tools/cli/run_progress.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::cli {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

RunProgressView rotating() {
  RunProgressView view;
  view.words = "rotating, pulling data";
  view.state = "rotating";
  view.left_s = 754.0;
  view.position = 4;
  view.positions = 19;
  view.pages_pulled = 120;
  view.pages_expected = 840;
  view.sigma.assign(sensor_parameter_count, 0.5);
  view.tolerance.assign(sensor_parameter_count, 1.0);
  view.sigma[4] = 6.2;
  return view;
}

TEST(RunProgress, NeverWiderThanTheTerminal) {
  for (int columns = 0; columns <= 200; ++columns) {
    EXPECT_LE(progress_line(3, rotating(), columns).size(), static_cast<std::size_t>(columns));
  }
}

TEST(RunProgress, PartsThatDoNotFitAreLeftOutWhole) {
  EXPECT_EQ(progress_line(3, rotating(), 50), "run 3: rotating, pulling data, 12:34 left");
  EXPECT_EQ(progress_line(3, rotating(), 79),
            "run 3: rotating, pulling data, 12:34 left, position 4 of 19, 23 of 24 known");
  EXPECT_THAT(progress_line(3, rotating(), 200), HasSubstr("gyro_drift_y 6.20 of 1.00 deg/h, page 120 of 840"));
}

TEST(RunProgress, ALostLinkComesFirst) {
  RunProgressView view = rotating();
  view.link_up = false;
  EXPECT_EQ(progress_line(3, view, 45), "run 3: rotating, pulling data, LINK LOST");
}

TEST(RunProgress, HasNoClockWhereNothingTurns) {
  RunProgressView view = rotating();
  view.state = "estimating";
  view.words = "estimating";
  view.pass = 2;
  view.pass_fraction = 0.5;
  EXPECT_THAT(progress_line(3, view, 79), StartsWith("run 3: estimating, pass 2 50 %"));
  EXPECT_THAT(progress_line(3, view, 79), Not(HasSubstr("left")));
}

TEST(RunProgress, OneClock) {
  EXPECT_EQ(clock_text(59.6), "1:00");
  EXPECT_EQ(clock_text(3723), "1:02:03");
  EXPECT_EQ(clock_text(-5), "0:00");
}

}  // namespace
}  // namespace selfcal::cli
