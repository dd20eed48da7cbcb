// The screen of `selfcal monitor` as text: monitor_terminal_test has the whole screen, this the corners.
#include "tools/cli/monitor_view.hpp"

#include <gmock/gmock.h>

#include <cmath>

namespace selfcal::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

MonitorState state_of(std::initializer_list<const char*> names) {
  MonitorState state;
  for (const char* name : names) {
    selfcal_lcm::ins_status status{};
    status.ins = name;
    status.serial = "SN-1";
    status.state = "rotating";
    status.link_up = 1;
    state.instruments[name].status = status;
  }
  return state;
}

std::string joined(const std::vector<ScreenLine>& lines) {
  std::string text;
  for (const ScreenLine& line : lines) {
    text += line.text + "\n";
  }
  return text;
}

selfcal_lcm::alarm alarm(const char* text, bool standing) {
  selfcal_lcm::alarm message{};
  message.ins = "one";
  message.run = 3;
  message.standing = standing ? 1 : 0;
  message.text = text;
  return message;
}

TEST(MonitorView, FillsExactlyAnyScreen) {
  MonitorState state = state_of({"one", "two"});
  selfcal_lcm::estimate estimate{};
  for (int k = 0; k < 24; ++k) {
    estimate.name.emplace_back("accel_misalignment_yx");  // the longest
    estimate.unit.emplace_back("arcsec");
    estimate.sigma.push_back(9990.0);
    estimate.tolerance.push_back(5.0);
  }
  estimate.count = 24;
  state.instruments["one"].estimate = estimate;
  for (const int rows : {1, 5, 24, 60}) {
    for (const int columns : {1, 40, 80, 200}) {
      const auto lines = monitor_screen(state, 0, columns, rows);
      ASSERT_EQ(lines.size(), static_cast<std::size_t>(rows));
      for (const ScreenLine& line : lines) {
        EXPECT_LE(line.text.size(), static_cast<std::size_t>(columns));
      }
    }
  }
  // On 80 columns nothing of the two columns of parameters is cut.
  const auto whole = monitor_screen(state, 0, 200, 24);
  for (const ScreenLine& line : whole) {
    EXPECT_LE(line.text.size(), 80u) << line.text;
  }
}

TEST(MonitorView, ShowsOneInsInFullAndTheOthersInALine) {
  const MonitorState state = state_of({"one", "two"});
  EXPECT_THAT(joined(monitor_screen(state, 0, 80, 24)), HasSubstr("one SN-1: rotating, run 0\nschedule"));
  EXPECT_THAT(joined(monitor_screen(state, 1, 80, 24)), HasSubstr("two SN-1: rotating, run 0\nschedule"));
  EXPECT_THAT(joined(monitor_screen(state, 1, 80, 24)), HasSubstr("one SN-1: rotating, position 0 of 0"));
}

TEST(MonitorView, AnAlarmStandsUntilItIsOver) {
  MonitorState state = state_of({"one"});
  state.take(alarm("the link is lost", true));
  EXPECT_THAT(joined(monitor_screen(state, 0, 80, 24)), HasSubstr("ALARM one run 3: the link is lost"));
  state.take(alarm("the link is lost", false));
  const std::string after = joined(monitor_screen(state, 0, 80, 24));
  EXPECT_THAT(after, Not(HasSubstr("ALARM")));
  EXPECT_THAT(after, HasSubstr("event one run 3: the link is lost"));
}

TEST(MonitorView, SaysThatNothingWasHeard) {
  EXPECT_THAT(joined(monitor_screen({}, 0, 80, 24)), HasSubstr("no daemon heard yet"));
}

// A sigma that is not yet a number, or a tolerance that is not told, is neither met nor a full bar.
TEST(MonitorView, NoNumberMeetsNoTolerance) {
  MonitorState state = state_of({"one"});
  selfcal_lcm::estimate estimate{};
  estimate.name = {"accel_bias_x", "accel_bias_y"};
  estimate.unit = {"ug", "ug"};
  estimate.sigma = {NAN, 1.0};
  estimate.tolerance = {10.0, 0.0};
  estimate.count = 2;
  state.instruments["one"].estimate = estimate;
  const std::string text = joined(monitor_screen(state, 0, 80, 24));
  EXPECT_THAT(text, HasSubstr("nan ug"));
  EXPECT_THAT(text, Not(HasSubstr(" ok")));
}

}  // namespace
}  // namespace selfcal::cli
