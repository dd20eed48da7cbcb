// Every fault that the format names, put into a sound recording: one clear error with dataset, row and value.
#include "protocol/recording/check.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "protocol/recording/gimbal_check.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal {
namespace {

using test::sample_recording;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

std::string error_of(const Recording& recording, const CheckPolicy& policy = {}) {
  const auto checked = check_recording(recording, policy);
  if (checked) {
    return "no error";
  }
  EXPECT_EQ(checked.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(checked.error().message.find('\n'), std::string::npos);
  return checked.error().message;
}

TEST(CheckRecording, SoundOneHasNoWarning) {
  const auto checked = check_recording(sample_recording());
  ASSERT_TRUE(checked) << checked.error().message;
  EXPECT_TRUE(checked->empty());
}

TEST(CheckRecording, NonFiniteValueIsNamed) {
  Recording r = sample_recording();
  r.delta_theta_rad[17][2] = nan;
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("delta_theta_rad"), HasSubstr("row 17"), HasSubstr("nan")));
  r = sample_recording();
  r.delta_v_mps[600][0] = -infinite;
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("delta_v_mps"), HasSubstr("row 600, column 0"), HasSubstr("-inf")));
  r = sample_recording();
  r.gimbal_inner_rad[3] = infinite;
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("gimbal_inner_rad"), HasSubstr("row 3"), HasSubstr("inf")));
  r = sample_recording();
  r.temperature_c[2 * 41 + 1] = nan;
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("temperature_c"), HasSubstr("row 41, column 1")));
  r = sample_recording();
  r.schedule_deg[1][0] = nan;
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("schedule_deg"), HasSubstr("row 1, column 0")));
}

TEST(CheckRecording, TimeMustIncrease) {
  Recording r = sample_recording();
  r.time_s[100] = r.time_s[99];
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("time_s: row 100"), HasSubstr("not after"), HasSubstr("2 s")));
}

TEST(CheckRecording, GapIsNamedAndMayBeLetPass) {
  Recording r = sample_recording();
  for (std::size_t row = 500; row < r.size(); ++row) {
    r.time_s[row] += 0.5;
  }
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("time_s: row 500"), HasSubstr("gap of 0.52 s")));
  const auto lenient = check_recording(r, {.gaps_are_errors = false});
  ASSERT_TRUE(lenient) << lenient.error().message;
  EXPECT_THAT(*lenient, ::testing::ElementsAre(HasSubstr("row 500")));
}

// Switched off for twice as long as it was on: its rate is what it was before and behind.
TEST(CheckRecording, ALongGapDoesNotChangeTheRate) {
  Recording r = sample_recording();
  const double length_s = r.time_s.back();
  for (std::size_t row = 500; row < r.size(); ++row) {
    r.time_s[row] += 2.0 * length_s;
  }
  const auto lenient = check_recording(r, {.gaps_are_errors = false});
  ASSERT_TRUE(lenient) << lenient.error().message;
  EXPECT_THAT(*lenient, ::testing::ElementsAre(HasSubstr("row 500")));
}

TEST(CheckRecording, JitterOfATenthIsNoGap) {
  Recording r = sample_recording();
  for (std::size_t row = 0; row < r.size(); row += 2) {
    r.time_s[row] += 0.1 / r.sample_rate_hz;
  }
  EXPECT_EQ(error_of(r), "no error");
}

TEST(CheckRecording, RateThatContradictsTime) {
  for (const double rate : {25.0, 49.9, 50.1, 100.0, 200.0}) {
    Recording r = sample_recording();
    r.sample_rate_hz = rate;
    EXPECT_THAT(error_of(r), AllOf(HasSubstr("sample_rate_hz"), HasSubstr("contradicts"), HasSubstr("50 Hz"))) << rate;
  }
  Recording r = sample_recording();
  r.sample_rate_hz = 50.01;  // 2e-4: a crystal
  EXPECT_EQ(error_of(r), "no error");
}

TEST(CheckRecording, SiteAndTimingInRange) {
  for (const auto& [member, name] : {std::pair{&Recording::latitude_deg, "latitude_deg"},
                                     {&Recording::longitude_deg, "longitude_deg"},
                                     {&Recording::height_m, "height_m"},
                                     {&Recording::sample_rate_hz, "sample_rate_hz"}}) {
    for (const double value : {-1e6, 1e6, nan, infinite}) {
      Recording r = sample_recording();
      r.*member = value;
      EXPECT_THAT(error_of(r), AllOf(HasSubstr(name), HasSubstr("outside"))) << value;
    }
  }
  Recording r = sample_recording();
  r.latitude_deg = 90.001;
  EXPECT_THAT(error_of(r), HasSubstr("latitude_deg = 90.001"));
}

TEST(CheckRecording, LengthsMustAgree) {
  Recording r = sample_recording();
  r.delta_v_mps.pop_back();
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("delta_v_mps"), HasSubstr("1199 rows"), HasSubstr("1200")));
  Recording empty;
  empty.sample_rate_hz = 50.0;
  EXPECT_THAT(error_of(empty), HasSubstr("time_s: 0 rows"));
}

TEST(CheckRecording, IncrementsInTheWrongUnitAreNotGravity) {
  Recording r = sample_recording();
  for (auto& d : r.delta_v_mps) {
    for (double& component : d) {
      component /= 9.80665;  // in g s
    }
  }
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("delta_v_mps"), HasSubstr("mean specific force")));
}

class GimbalCheck : public ::testing::Test {
 protected:
  Recording r = sample_recording();
};

TEST_F(GimbalCheck, ReversedAxis) {
  for (double& angle : r.gimbal_outer_rad) {
    angle = -angle;
  }
  EXPECT_THAT(error_of(r), AllOf(HasSubstr("gimbal_outer_rad"), HasSubstr("rows"), HasSubstr("deg")));
}

TEST_F(GimbalCheck, SwappedAxes) {
  std::swap(r.gimbal_outer_rad, r.gimbal_inner_rad);
  EXPECT_THAT(error_of(r), HasSubstr("delta_theta_rad"));
}

TEST_F(GimbalCheck, StandsStillWhileTheGyrosTurn) {
  for (double& angle : r.gimbal_inner_rad) {
    angle = 0.0;
  }
  EXPECT_THAT(error_of(r), HasSubstr("read-outs turned 0.0 and 0.0 deg"));
}

// A log of a sensor that a hand turned has no read-outs: neither of them is wrong.
TEST_F(GimbalCheck, NoReadOutsAreNoneThatIsWrong) {
  const CheckPolicy lenient{.gimbal_contradiction_is_error = false};
  std::fill(r.gimbal_inner_rad.begin(), r.gimbal_inner_rad.end(), 0.0);
  const auto outer_turns = check_recording(r, lenient);
  ASSERT_TRUE(outer_turns);
  EXPECT_THAT(*outer_turns, ElementsAre(HasSubstr("tells which of them is wrong")));
  std::fill(r.gimbal_outer_rad.begin(), r.gimbal_outer_rad.end(), 0.0);
  const auto by_hand = check_recording(r, lenient);
  ASSERT_TRUE(by_hand);
  EXPECT_THAT(*by_hand, ElementsAre(AllOf(HasSubstr("none were recorded, or a hand turned the sensor"),
                                          Not(HasSubstr("wrong")))));
}

// Who recorded it has said so: no word. Where they turn after all, and for an estimate, which needs them, it is what it was.
TEST_F(GimbalCheck, ReadOutsThatAreSaidToBeAbsentAreNotMissed) {
  const CheckPolicy lenient{.gimbal_contradiction_is_error = false};
  r.gimbal_absent = true;
  std::fill(r.gimbal_inner_rad.begin(), r.gimbal_inner_rad.end(), 0.0);
  const auto outer_turns = check_recording(r, lenient);
  ASSERT_TRUE(outer_turns);
  EXPECT_THAT(*outer_turns, ElementsAre(HasSubstr("tells which of them is wrong")));
  std::fill(r.gimbal_outer_rad.begin(), r.gimbal_outer_rad.end(), 0.0);
  EXPECT_THAT(error_of(r), HasSubstr("read-outs turned 0.0 and 0.0 deg"));
  const auto by_hand = check_recording(r, lenient);
  ASSERT_TRUE(by_hand);
  EXPECT_THAT(*by_hand, IsEmpty());
}

// Angles as commanded, on a clock of their own: whoever estimates is told, a log is not. The
// same with an axis reversed, exchanged, or gyros in degrees is.
TEST_F(GimbalCheck, AReadOutThatLagsIsNotWrong) {
  const CheckPolicy lenient{.gimbal_contradiction_is_error = false};
  const auto late = [](const std::vector<double>& angle, double rate_hz) {
    std::vector<double> lagging;
    for (std::size_t row = 0; row < angle.size(); ++row) {
      const double lag_s = 0.4 + 0.3 * static_cast<double>(row) / static_cast<double>(angle.size());
      const auto rows = static_cast<std::size_t>(std::lround(lag_s * rate_hz));
      lagging.push_back(angle[row > rows ? row - rows : 0]);
    }
    return lagging;
  };
  r.gimbal_outer_rad = late(r.gimbal_outer_rad, r.sample_rate_hz);
  r.gimbal_inner_rad = late(r.gimbal_inner_rad, r.sample_rate_hz);
  const auto words = [&](const Recording& recording) {
    const auto warnings = check_recording(recording, lenient);
    return warnings ? *warnings : std::vector<std::string>{warnings.error().message};
  };
  EXPECT_THAT(error_of(r), HasSubstr("deg apart"));
  EXPECT_THAT(words(r), IsEmpty());
  Recording reversed = r;
  for (double& angle : reversed.gimbal_outer_rad) {
    angle = -angle;
  }
  EXPECT_THAT(words(reversed), ElementsAre(HasSubstr("deg apart")));
  Recording exchanged = r;
  std::swap(exchanged.gimbal_outer_rad, exchanged.gimbal_inner_rad);
  EXPECT_THAT(words(exchanged), ElementsAre(HasSubstr("deg apart")));
  Recording degrees = r;
  for (auto& d : degrees.delta_theta_rad) {
    for (double& component : d) {
      component *= 180.0 / std::numbers::pi;
    }
  }
  EXPECT_THAT(words(degrees), ElementsAre(HasSubstr("deg apart")));
}

// A read-out that goes from 0.0 past zero to 359.4 deg has turned by -0.6.
TEST_F(GimbalCheck, AReadOutThatPassesZeroHasNotTurnedAllTheWay) {
  for (double& angle : r.gimbal_inner_rad) {
    angle = 0.0;
  }
  const auto still = find_gimbal_contradiction(r);
  ASSERT_TRUE(still);
  for (std::size_t row = still->first_row + 1; row < r.size(); ++row) {
    const double angle = r.gimbal_outer_rad[row] - 0.6 * std::numbers::pi / 180.0;
    r.gimbal_outer_rad[row] = angle - std::floor(angle / (2.0 * std::numbers::pi)) * 2.0 * std::numbers::pi;
  }
  const auto wrapped = find_gimbal_contradiction(r);
  ASSERT_TRUE(wrapped);
  ASSERT_EQ(wrapped->first_row, still->first_row);
  EXPECT_NEAR(wrapped->outer_turn_deg, still->outer_turn_deg - 0.6, 1e-9);
}

TEST_F(GimbalCheck, DegreesForRadians) {
  for (double& angle : r.gimbal_outer_rad) {
    angle *= 180.0 / std::numbers::pi;
  }
  EXPECT_THAT(error_of(r), HasSubstr("gimbal"));
}

TEST_F(GimbalCheck, AWarningWhereThePolicySaysSo) {
  for (double& angle : r.gimbal_outer_rad) {
    angle = -angle;
  }
  const auto checked = check_recording(r, {.gimbal_contradiction_is_error = false});
  ASSERT_TRUE(checked);
  EXPECT_THAT(*checked, ::testing::ElementsAre(HasSubstr("gimbal")));
}

TEST_F(GimbalCheck, OneDegreeOfReadOutErrorIsAllowed) {
  for (double& angle : r.gimbal_outer_rad) {
    angle *= 1.0 + 1.0 / 90.0;  // 1 deg over the turn
  }
  EXPECT_EQ(error_of(r), "no error");
}

}  // namespace
}  // namespace selfcal
