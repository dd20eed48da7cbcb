// How a text is written, from its lines alone.
#include <gmock/gmock.h>

#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {
namespace {

using ::testing::ElementsAre;

std::optional<TextDialect> dialect_of(std::vector<std::string_view> lines) { return detect_dialect(lines); }

TEST(Dialect, CommasWithNames) {
  const auto d = dialect_of({"t,gx,gy", "0.1,1,2", "0.2,3,4"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->separator, ',');
  EXPECT_EQ(d->decimal, '.');
  EXPECT_EQ(d->header_line, 1U);
  EXPECT_EQ(d->first_line, 2U);
}

TEST(Dialect, DecimalCommasBetweenSemicolonsTabsBlanksAndQuotes) {
  for (const auto& [line, separator] : {std::pair{"0,1;-1,5;2", ';'}, std::pair{"0,1\t-1,5\t2", '\t'},
                                        std::pair{"  0,1   -1,5 2", ' '}, std::pair{"\"0,1\",\"-1,5\",\"2\"", ','}}) {
    const auto d = dialect_of({line, line});
    ASSERT_TRUE(d) << line;
    EXPECT_EQ(d->separator, separator) << line;
    EXPECT_EQ(d->decimal, ',') << line;
    std::vector<std::string_view> fields;
    split_fields(line, d->separator, fields);
    ASSERT_EQ(fields.size(), 3U) << line;
    EXPECT_EQ(number_of(fields[1], d->decimal), -1.5) << line;
  }
}

// Only few rows have thousands, and the names stand above those that have none.
TEST(Dialect, PointsBetweenThousandsEndNoTable) {
  const auto d =
      dialect_of({"Zeit [ms];ax [mg]", "980;410,39", "990;911,40", "1.000;1.001,27", "1.010;-1.002,5", "1.020;12,5"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->decimal, ',');
  EXPECT_EQ(d->header_line, 1U);
  EXPECT_EQ(d->first_line, 2U);
}

TEST(Dialect, ACommaAndABlankAreACommaAndABlank) {
  const auto d = dialect_of({"1, 5, 2", "3, 4, 5"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->separator, ',');
}

TEST(Dialect, WordsAndDaysAmongTheNumbers) {
  const auto d = dialect_of({"IMU1;17.05.2024;0,1;-2,5;3", "IMU1;17.05.2024;0,2;-2,4;4"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->separator, ';');
  EXPECT_EQ(d->decimal, ',');
  EXPECT_EQ(d->first_line, 1U);
}

TEST(Dialect, CommentsNamesInACommentAndALineOfUnits) {
  const auto d = dialect_of({"# made in 2024", "# t;gx;gy", "", "1;2;3", "4;5;6"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->comment, "#");
  EXPECT_EQ(d->header_line, 2U);
  EXPECT_EQ(d->first_line, 4U);
  const auto u = dialect_of({"time;gx;gy", "[s];[deg/s];[deg/s]", "1;2;3", "4;5;6"});
  ASSERT_TRUE(u);
  EXPECT_EQ(u->header_line, 1U);
  EXPECT_EQ(u->unit_line, 2U);
  EXPECT_THAT(header_fields("[s];[deg/s];(m)", *u), ElementsAre("s", "deg/s", "m"));
}

TEST(Dialect, NoNumbersNoDialect) {
  EXPECT_FALSE(dialect_of({"a,b,c", "d,e,f"}));
  EXPECT_FALSE(dialect_of({}));
  EXPECT_FALSE(dialect_of({"1", "2", "3"}));
}

TEST(Dialect, OneLongColumnOfNumbersIsOne) {
  std::vector<std::string_view> lines(150, "0.0123");
  const auto plain = dialect_of(lines);
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->header_line, 0U);
  lines.insert(lines.begin(), "omega_dps");
  const auto named = dialect_of(lines);
  ASSERT_TRUE(named);
  EXPECT_EQ(named->header_line, 1U);
  lines.insert(lines.begin() + 20, 40, "a word");  // a text with numbers in it
  EXPECT_FALSE(dialect_of(lines));
}

TEST(Numbers, OnlyWholeFields) {
  EXPECT_EQ(number_of("+1.5e3", '.'), 1500.0);
  EXPECT_EQ(number_of("1.5D-3", '.'), 1.5e-3);  // Fortran
  EXPECT_EQ(number_of("0x1F", '.'), 31.0);      // a register
  for (const char* wrong : {"", "+-1", "1.2.3", "0x", "0xG1", "-0x10", "0x1.8", "1 2", "1,5"}) {
    EXPECT_FALSE(number_of(wrong, '.')) << wrong;
  }
  TextDialect german, english;
  german.decimal = ',';
  EXPECT_EQ(grouped_number_of("1.234.567,5", german), 1234567.5);
  EXPECT_EQ(grouped_number_of("-1.000", german), -1000.0);
  EXPECT_EQ(grouped_number_of("1.000", english), 1.0);
  for (const char* wrong : {"1.23,5", "1234.567,5", ".123", "1..234", "1.234.56", "12,345.6", "1.234,5.6"}) {
    EXPECT_FALSE(grouped_number_of(wrong, german)) << wrong;
  }
  EXPECT_FALSE(number_of("1.234,5", ','));  // points between thousands are refused, not passed over
}

TEST(Dates, SecondsSince1970AndOffsets) {
  // 2024-02-29 is day 19782 of the epoch: date -u -d 2024-02-29 +%s is 1709164800.
  EXPECT_EQ(date_of("2024-02-29T00:00:01.5Z"), 1709164801.5L);
  EXPECT_EQ(date_of("2024-02-29 02:00:00+02:00"), 1709164800.0L);
  EXPECT_EQ(date_of("01:00:00"), 3600.0L);
  EXPECT_EQ(date_of("01:02.5"), 62.5L);      // minutes and seconds, as spreadsheets show them
  EXPECT_EQ(date_of("75:00,25"), 4500.25L);  // elapsed
  EXPECT_EQ(date_of("01:75.5"), std::nullopt);
  EXPECT_EQ(date_of("01:02"), std::nullopt);
  // date -u -d '2023-10-04 10:12:33' +%s
  for (const char* same : {"04-Oct-2023 10:12:33.125", "10/4/2023 10:12:33.125 AM", "4.10.2023 10:12:33,125",
                           "2023-10-04 10:12:33:125", "2023/10/04 10:12:33.125"}) {
    EXPECT_EQ(date_of(same), 1696414353.125L) << same;
  }
  EXPECT_EQ(date_of("12:00:01 AM"), 1.0L);
  EXPECT_EQ(date_of("1:00:00 pm"), 46800.0L);
  EXPECT_EQ(date_of("13/10/2023 00:00:00"), date_of("2023-10-13T00:00:00"));  // no thirteenth month
  for (const char* wrong : {"13:00:00 PM", "4-Okt 10:12:33", "10/4/23 10:12:33", "1.5:00:00", "2023-02-29T00:00:00",
                            "2024-13-01T00:00:00", "25:00:00", "2024-02-29", "2024-02-29T00:61:00"}) {
    EXPECT_FALSE(date_of(wrong)) << wrong;
  }
}

TEST(Dates, AsCWritesThem) {
  for (const char* same : {"Wed Oct  4 10:12:33 2023", "Oct 4 10:12:33 2023", "Wed Oct 4 13:12:33 GMT+03:00 2023",
                           "Wed, Oct 4 10:12:33 UTC 2023"}) {
    EXPECT_EQ(date_of(same), 1696414353.0L) << same;
  }
  for (const char* none : {"Wed Feb 31 10:12:33 2023", "Wed Oct 4 10:12:33", "Wed", "Octopus 4 10:12:33 2023"}) {
    EXPECT_FALSE(date_of(none)) << none;
  }
  EXPECT_EQ(date_words(1696414353.25L), "2023-10-04 10:12:33.250");
  EXPECT_EQ(date_words(36733.5L), "10:12:13.500");
}

// Satellites in range, among a phone's readings.
TEST(Dialect, SoManyOfSoManyAreAWord) {
  const auto d = dialect_of({"x;y;Satellites", "0.1;2.5;13 / 22", "0.2;2.6;12 / 22"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->separator, ';');
  EXPECT_EQ(d->header_line, 1U);
}

TEST(Dialect, RowsOfATableThatMostlyLacksEndNoTable) {
  const auto d = dialect_of({"Index,Time,x,y,z", "0,,,,", "1,2018:522.0,,,", "2,,0.1,0.2,9.8", "3,2018:523.0,,,"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->header_line, 1U);
  EXPECT_EQ(d->first_line, 2U);
}

TEST(Dialect, TheTimeOfASerialMonitorIsAField) {
  const std::vector<std::string_view> lines{"10:12:13.100 -> ax,ay,az", "10:12:13.110 -> 0.1,-2,9.8",
                                            "10:12:13.120 -> 0.2,-2,9.7"};
  const auto d = dialect_of(lines);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->separator, ',');
  EXPECT_EQ(d->header_line, 1U);
  EXPECT_THAT(header_fields(lines[0], *d), ElementsAre("arrival time", "ax", "ay", "az"));
  std::vector<std::string_view> fields;
  split_fields(lines[1], d->separator, fields);
  EXPECT_THAT(fields, ElementsAre("10:12:13.110", "0.1", "-2", "9.8"));
}

// A word and a colon that a program prints before each line.
TEST(Dialect, AMarkBeforeTheNumbersIsAField) {
  const std::vector<std::string_view> lines{"IMU:0.1,-2,9.8,1,2,3", "IMU: 0.2,-2,9.7,1,2,4"};
  const auto d = dialect_of(lines);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->fields, 7U);
  std::vector<std::string_view> fields;
  split_fields(lines[1], d->separator, fields);
  EXPECT_EQ(fields[0], "IMU");
  EXPECT_EQ(fields[1], "0.2");
  split_fields("10:12:13,4,5", ',', fields);
  EXPECT_EQ(fields.size(), 3U);
}

TEST(Dialect, NamesOfOtherColumnsAreCounted) {
  const auto d = dialect_of({"n,gx,gy,gz,ax", "0,1,2,3,4,5,6", "1,2,3,4,5,6,7"});
  ASSERT_TRUE(d);
  EXPECT_EQ(d->header_line, 0U);
  EXPECT_EQ(d->other_names, 5U);
  EXPECT_EQ(d->fields, 7U);
}

TEST(Dialect, WhatIsNotReadIsNamed) {
  const std::vector<std::string_view> lines{"a,b,c,d", "1,2,3 of 7 4,5"};
  EXPECT_FALSE(detect_dialect(lines));
  EXPECT_EQ(unread_field(lines), "line 2, field 3: \"3 of 7 4\" is no number, no date and no word");
}

}  // namespace
}  // namespace selfcal::import
