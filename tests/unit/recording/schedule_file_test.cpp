#include "protocol/schedule_file/schedule_file.hpp"

#include <gmock/gmock.h>

namespace selfcal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string error_of(std::string_view toml) {
  const auto parsed = parse_schedule(toml, "s.toml");
  if (parsed) {
    return "no error";
  }
  EXPECT_EQ(parsed.error().kind, ErrorKind::bad_input);
  return parsed.error().message;
}

TEST(ScheduleFile, OneDwellForAll) {
  const auto parsed = parse_schedule("positions = [[0, 0], [90.5, -45]]\ndwell_s = 60\nrotation_s = 4.5\n", "s");
  ASSERT_TRUE(parsed) << parsed.error().message;
  ASSERT_EQ(parsed->positions.size(), 2U);
  EXPECT_EQ(parsed->positions[1].outer_deg, 90.5);
  EXPECT_EQ(parsed->positions[1].inner_deg, -45.0);
  EXPECT_THAT(parsed->dwell_s, ::testing::ElementsAre(60.0, 60.0));
  EXPECT_EQ(parsed->rotation_s, 4.5);
}

TEST(ScheduleFile, WrittenOnesReadBack) {
  Schedule schedule = named_schedule("horizontal", 61.25, 7.0).value();
  schedule.dwell_s[3] = 12.5;
  const auto parsed = parse_schedule(format_schedule(schedule), "s");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->dwell_s, schedule.dwell_s);
  EXPECT_EQ(parsed->rotation_s, schedule.rotation_s);
  ASSERT_EQ(parsed->positions.size(), schedule.positions.size());
  EXPECT_EQ(parsed->positions[14].inner_deg, schedule.positions[14].inner_deg);
}

TEST(ScheduleFile, ErrorsNameFileLineAndKey) {
  EXPECT_THAT(error_of("dwell_s = 1\n"), HasSubstr("s.toml: positions: missing"));
  EXPECT_THAT(error_of("\npositions = 3\ndwell_s = 1\n"), HasSubstr("s.toml:2: positions: 3 is not an array"));
  EXPECT_THAT(error_of("positions = [[0, 0],\n [1]]\ndwell_s = 1\n"), HasSubstr("s.toml:2: positions[1]"));
  EXPECT_THAT(error_of("positions = [[0, \"a\"]]\ndwell_s = 1\n"), HasSubstr("is not a number"));
  EXPECT_THAT(error_of("positions = [[0, nan]]\ndwell_s = 1\n"), HasSubstr("is not a finite number"));
  EXPECT_THAT(error_of("positions = []\ndwell_s = 1\n"), HasSubstr("0 positions"));
  EXPECT_THAT(error_of("positions = [[0, 9000]]\ndwell_s = 1\n"), HasSubstr("position 0: 9000 deg"));
  EXPECT_THAT(error_of("positions = [[0, 0]]\n"), HasSubstr("dwell_s: missing"));
  EXPECT_THAT(error_of("positions = [[0, 0]]\ndwell_s = 0\n"), AllOf(HasSubstr("s.toml:2: dwell_s"), HasSubstr("0 s")));
  EXPECT_THAT(error_of("positions = [[0, 0]]\ndwell_s = [1, 2]\n"), HasSubstr("2 dwells for 1 positions"));
  EXPECT_THAT(error_of("positions = [[0, 0]]\ndwell_s = 1\nrotation_s = -1\n"), HasSubstr("s.toml:3: rotation_s"));
  EXPECT_THAT(error_of("positions = [[0, 0]]\ndwell_s = 1\ndwel_s = 1\n"), HasSubstr("s.toml:3: dwel_s: no such key"));
  EXPECT_THAT(error_of("positions = [[0,"), HasSubstr("s.toml:1"));
}

TEST(ScheduleFile, FindsNamesAndReplacesTiming) {
  const auto found = find_schedule("table2", 20.0, 6.0);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->positions.size(), 19U);
  EXPECT_DOUBLE_EQ(found->duration_s(), 19 * 20.0 + 18 * 6.0);
  EXPECT_EQ(find_schedule("no-such").error().kind, ErrorKind::usage);
  EXPECT_EQ(find_schedule("table2", 0.0).error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace selfcal
