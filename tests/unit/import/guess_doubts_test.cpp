// What a guess says and doubts of a text whose head tells little.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "protocol/import/guess.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

class GuessDoubts : public ::testing::Test {
 protected:
  // All remarks of KEY, doubts or assumptions.
  std::string remarks(const std::string& text, std::string_view key, bool doubts) {
    std::ofstream(folder_ / "log.csv") << text;
    const auto source = open_columns(folder_ / "log.csv");
    const auto guess = source ? guess_map(**source, {}, "log.csv") : tl::make_unexpected(source.error());
    if (!guess) {
      return guess.error().message;
    }
    std::string all;
    for (const Remark& remark : guess->remarks) {
      all += remark.key == key && remark.doubt == doubts ? remark.text + "\n" : "";
    }
    return all;
  }
  // A sensor at rest under HEAD, each row begun by what BEGIN makes of its number.
  template <typename Begin>
  static std::string log(const std::string& head, Begin begin, double gravity = 9.81) {
    std::string text = head;
    for (int k = 0; k < 400; ++k) {
      text += fmt::format("{}{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f}\n", begin(k), 0.01 * (k % 3), 0.02 * (k % 5),
                          gravity + 1e-3 * (k % 7), 1e-3 * (k % 4), 2e-3 * (k % 3), -1e-3 * (k % 5));
    }
    return text;
  }
  const test::TemporaryFolder folder_;
};

const std::string names = "ax,ay,az,gx,gy,gz\n";

TEST_F(GuessDoubts, ATimeThatOnlyCountsRows) {
  const std::string text = log("Timestamp," + names, [](int k) { return fmt::format("{},", k); });
  EXPECT_THAT(remarks(text, "time.unit", true), HasSubstr("intervals of 1"));
}

TEST_F(GuessDoubts, MillisecondsSince1970AreNone) {
  const std::string text =
      log("timestamp," + names, [](int k) { return fmt::format("{},", 1582107260391L + 50 * k + k % 3); });
  EXPECT_EQ(remarks(text, "time.unit", true), "");
  EXPECT_THAT(remarks(text, "time.unit", false), HasSubstr("ms: 2"));
}

TEST_F(GuessDoubts, TwoClocksThatRunApart) {
  const auto rows = [](double faster) {
    return log("time,field.header.stamp," + names,
               [faster](int k) { return fmt::format("{:.0f},{:.0f},", 1.58e18 + 1e7 * faster * k, 3e12 + 1e7 * k); });
  };
  EXPECT_EQ(remarks(rows(1.0), "time.column", true), "");
  EXPECT_THAT(remarks(rows(1.0), "time.column", false), HasSubstr("field.header.stamp"));
  EXPECT_THAT(remarks(rows(1.8), "time.column", true), HasSubstr("1.8 times as fast"));
}

TEST_F(GuessDoubts, TheRateThatTheHeadSays) {
  const std::string text = log("# Output rate: 100.0Hz\n" + names, [](int) { return ""; });
  EXPECT_THAT(remarks(text, "time", true), HasSubstr("the head says 100.0 Hz"));
  EXPECT_THAT(remarks(text, "accelerometer.unit", true), HasSubstr("m/s^2 if these are rates"));
}

TEST_F(GuessDoubts, AccelerometersWithoutGravity) {
  const std::string text = log(
      "t,user_acc_x(G),user_acc_y(G),user_acc_z(G),rotation_rate_x(radians/s),rotation_rate_y(radians/s),"
      "rotation_rate_z(radians/s)\n",
      [](int k) { return fmt::format("{:.2f},", 0.01 * k); }, 0.0);
  EXPECT_THAT(remarks(text, "accelerometer.unit", true), HasSubstr("gravity is not in it"));
  EXPECT_THAT(remarks(text, "gyro.unit", false), HasSubstr("rad/s by its name"));
}

TEST_F(GuessDoubts, ANamedColumnThatLacksNumbers) {
  const std::string text = log("t," + names, [](int k) {
    return fmt::format("{:.2f},{}", 0.01 * k, k % 5 == 0 ? ",,,,,\n" + fmt::format("{:.3f},", 0.01 * k + 0.005) : "");
  });
  EXPECT_THAT(remarks(text, "accelerometer.columns", true), HasSubstr("lack its number"));
}

}  // namespace
}  // namespace selfcal::import
