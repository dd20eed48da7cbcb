// The map: what is read, what is refused with line and key, and that what is written reads back.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "protocol/import/import_map.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

constexpr const char* sound = R"(map = 1
[site]
latitude_deg = 48.0
longitude_deg = 11
height_m = 500
[time]
column = "t"
unit = "ms"
origin = "first"
[gyro]
columns = ["gx", 3, "gz"]
kind = "rates"
unit = "deg/s"
axes = ["y", "-x", "z"]
[accelerometer]
columns = [5, 6, 7]
kind = "increments"
unit = "ug*s"
scale = 125
[gimbal]
outer = 8
inner = 9
unit = "deg"
signs = [1, -1]
)";

std::string with(std::string_view from, std::string_view to) {
  std::string text = sound;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string fault_of(const std::string& text) {
  const auto map = parse_import_map(text, "lab.toml");
  return map ? std::string() : map.error().message;
}

TEST(ImportMap, ReadsWhatItSays) {
  const auto map = parse_import_map(sound, "lab.toml");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->gyro.columns[0].name, "gx");
  EXPECT_EQ(map->gyro.columns[1].number, 3U);
  EXPECT_EQ(map->gyro.axes[1].column, 0);
  EXPECT_EQ(map->gyro.axes[1].sign, -1.0);
  EXPECT_TRUE(map->accelerometer.increments);
  EXPECT_EQ(map->accelerometer.scale[2], 125.0);
  EXPECT_TRUE(map->time.origin_first);
  EXPECT_EQ(map->gimbal.signs[1], -1.0);
}

TEST(ImportMap, RefusesWithLineAndKey) {
  struct Case {
    std::string text, words;
  };
  for (const auto& [text, words] :
       {Case{with("map = 1", "map = 2"), "lab.toml:1: map"},
        Case{with("unit = \"deg/s\"", "unit = \"m/s\""), "lab.toml:13: gyro.unit: \"m/s\" is no unit of rates"},
        Case{with("axes = [\"y\", \"-x\", \"z\"]", "axes = [\"y\", \"-y\", \"z\"]"), "lab.toml:14: gyro.axes"},
        Case{with("columns = [5, 6, 7]", "columns = [5, 6]"), "lab.toml:16: accelerometer.columns: 3 columns"},
        Case{with("columns = [5, 6, 7]", "columns = [0, 6, 7]"), "accelerometer.columns: a column is expected"},
        Case{with("kind = \"rates\"", "kind = \"rate\""), "gyro.kind: \"rate\" is none of rates, increments"},
        Case{with("scale = 125", "scales = 125"), "accelerometer.scales: unknown key; did you mean scale?"},
        Case{with("signs = [1, -1]", "signs = [1, 2]"), "gimbal.signs: 2 is neither 1 nor -1"},
        Case{with("outer = 8\ninner = 9\n", ""), "gimbal: one of these is expected"},
        Case{with("[gyro]", "[gyros]"), "gyros: unknown key; did you mean gyro?"},
        Case{with("column = \"t\"\n", ""), "time: neither a column nor recording.sample_rate_hz"},
        Case{with("scale = 125", "scale = nan"), "accelerometer.scale: a finite number"}}) {
    EXPECT_THAT(fault_of(text), HasSubstr(words));
    EXPECT_EQ(fault_of(text).find('\n'), std::string::npos);
  }
}

TEST(ImportMap, WhatIsWrittenReadsBack) {
  auto map = parse_import_map(sound, "lab.toml");
  ASSERT_TRUE(map);
  map->gyro.columns[0].name = "a \"name\" \\ \xC2\xB0";
  map->dialect = TextDialect{' ', ',', "%", 3, 0, 5};
  map->unsettled = {"site"};
  map->gyro.scale = {0.1, 1.0 / 3.0, 1e-7};
  const std::string text =
      format_import_map(*map, {{"gyro.unit", "from the turns"}, {"site", "not in the file"}}, "# a map\n");
  const auto again = parse_import_map(text, "again.toml");
  ASSERT_TRUE(again) << again.error().message << text;
  EXPECT_EQ(again->gyro.columns[0].name, map->gyro.columns[0].name);
  EXPECT_EQ(again->gyro.scale, map->gyro.scale);
  EXPECT_EQ(again->dialect->separator, ' ');
  EXPECT_EQ(again->dialect->decimal, ',');
  EXPECT_EQ(again->dialect->first_line, 5U);
  EXPECT_EQ(again->unsettled, map->unsettled);
  EXPECT_EQ(again->gyro.axes[1].sign, -1.0);
  EXPECT_THAT(text, HasSubstr("# from the turns\nunit = \"deg/s\"\n"));
}

}  // namespace
}  // namespace selfcal::import
