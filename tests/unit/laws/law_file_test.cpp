// Files of laws: what is read, and thirty files that are wrong, each with one line that names law and key.
#include "protocol/law_file/law_file.hpp"

#include <gtest/gtest.h>

namespace selfcal {
namespace {

TEST(LawFile, ReadsWhatItWrites) {
  std::vector<LawText> laws(2);
  laws[0] = {5, "exp(-since/45.2)*so", "", 13.7, 0.4, std::nullopt};
  laws[1] = {0, "", "line", 0.02, std::nullopt, 19.5};
  const auto read = parse_laws(format_laws(laws), "x.toml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].axis, 5);
  EXPECT_EQ((*read)[0].expression, laws[0].expression);
  EXPECT_DOUBLE_EQ(*(*read)[0].coefficient, 13.7);
  EXPECT_EQ((*read)[1].process, "line");
  EXPECT_DOUBLE_EQ(*(*read)[1].frequency_hz, 19.5);
}

TEST(LawFile, WithoutCoefficientItIsToBeFitted) {
  const auto read = parse_laws("[[law]]\naxis = \"gyro_x\"\nexpression = \"fx*?\"\n", "x.toml");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->front().coefficient);
}

TEST(LawFile, EachWrongFileIsToldInOneLine) {
  const std::string head = "[[law]]\naxis = \"accel_x\"\nexpression = \"fx\"\n";
  struct Wrong {
    std::string text, words;
  };
  for (const Wrong& w : std::vector<Wrong>{
           {"", "no [[law]]"},
           {"law = 3", "no [[law]]"},
           {"[law]\naxis = \"accel_x\"", "no [[law]]"},
           {"law = [1, 2]", "no [[law]]"},
           {"[[law]]\naxis = ", "x.toml:2"},
           {"[[law]]\nexpression = \"fx\"", "law 1: axis: missing"},
           {"[[law]]\naxis = \"accel\"\nexpression = \"fx\"", "law 1: axis: no axis is called accel"},
           {"[[law]]\naxis = 3\nexpression = \"fx\"", "law 1: axis: no text"},
           {"[[law]]\naxis = \"accel_x\"", "law 1: expression: neither"},
           {head + "process = \"white\"", "law 1: expression: an expression and a process"},
           {"[[law]]\naxis = \"accel_x\"\nprocess = \"pink\"", "law 1: process: no process is called pink"},
           {"[[law]]\naxis = \"accel_x\"\nprocess = \"line\"", "law 1: frequency_hz: missing"},
           {head + "frequency_hz = 3.0", "law 1: frequency_hz: of no line"},
           {head + "unit = \"deg/h\"", "law 1: unit: \"deg/h\" where accel_x is in ug"},
           {head + "unit = 4", "law 1: unit: no text"},
           {head + "coefficient = \"3\"", "law 1: coefficient: no finite number"},
           {head + "coefficient = nan", "law 1: coefficient: no finite number"},
           {head + "coefficient = inf", "law 1: coefficient: no finite number"},
           {head + "sigma = -1.0", "law 1: sigma: -1 is negative"},
           {head + "sgima = 1.0", "law 1: sgima: unknown key"},
           {head + head + "color = 1", "law 2: color: unknown key"},
       }) {
    const auto read = parse_laws(w.text, "x.toml");
    ASSERT_FALSE(read) << w.text;
    EXPECT_NE(read.error().message.find(w.words), std::string::npos) << read.error().message;
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos) << read.error().message;
    EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
  }
}

}  // namespace
}  // namespace selfcal
