// What stands between a file and toml++: nothing that harms it gets through, and what gets through comes out unchanged.
#include "protocol/toml_file/toml_text.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "protocol/toml_file/toml_file.hpp"

namespace selfcal {
namespace {

using ::testing::HasSubstr;

// Two, three and four bytes, the ends of the first two kinds included; what toml++ gets to see is another text.
TEST(TomlText, OfAnyScriptComesOutAsItWentIn) {
  const std::string text = "J\u00F6rg \u0080\u07FF\u0800\uFEFF\uFFFF \u6E2C\u91CF \U0001F600";
  const auto parsed =
      TomlFile::parse(fmt::format("# \u00C5\nname = \"{}\"\n\"gr\u00F6\u00DFe\" = 1\n", text), "t.toml");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->text("name").value(), text);
  EXPECT_THAT(parsed->only({"name"}).error().message, HasSubstr("t.toml:3: gr\u00F6\u00DFe: no such key"));
  EXPECT_THAT(parsed->number("name").error().message, HasSubstr("J\u00F6rg"));
}

TEST(TomlText, AtAnyDepthComesOutAsItWentIn) {
  const auto table = parse_toml(
      "list = [{\"gr\u00F6\u00DFe\" = [\"\u6E2C\", 1]}]\n[a.\"\u00E4\"]\nb = \"\u00FC\"\n[a.\"\u00EB\"]\nb = "
      "\"\u00EF\"\n",
      "t.toml");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ((*table)["list"][0]["gr\u00F6\u00DFe"][0].value<std::string>(), "\u6E2C");
  EXPECT_EQ((*table)["list"][0]["gr\u00F6\u00DFe"][1].value<int>(), 1);
  EXPECT_EQ((*table)["a"]["\u00E4"]["b"].value<std::string>(), "\u00FC");
  EXPECT_EQ((*table)["a"]["\u00EB"]["b"].value<std::string>(), "\u00EF");
  EXPECT_EQ(table->get("a")->as_table()->size(), 2U);
  EXPECT_EQ(table->get("a")->as_table()->find("\u00EB")->first.source().begin.line, 4U);
}

// Values in a message: arrays of numbers below 0.1 as well, tables by what they are.
TEST(TomlText, AnErrorSaysTheValue) {
  const auto parsed = TomlFile::parse("a = [[0, 0.0625, -0.03125]]\nt = {x = 1}\nd = 1979-05-27\n", "t.toml");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_THAT(parsed->number("a").error().message, HasSubstr("t.toml:1: a: [[0, 0.0625, -0.03125]] is not a number"));
  EXPECT_THAT(parsed->number("t").error().message, HasSubstr("{...} is not a number"));
  EXPECT_THAT(parsed->number("d").error().message, HasSubstr("1979-05-27 is not a number"));
}

TEST(TomlText, WhereNoStringIsMeantIsAnError) {
  // U+00A1, U+2E3E and others: toml++ 3.3 takes them for impossible there.
  for (const char* text : {"t = 6='\u00C5", "t = 6='\u2E3E'", "t = \u00C5", "\u00C5 = 1", "t = 1979-05-27T='\u0100"}) {
    const auto table = parse_toml(text, "t.toml");
    ASSERT_FALSE(table) << text;
    EXPECT_EQ(table.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(table.error().message, ::testing::StartsWith("t.toml:1: "));
  }
  EXPECT_THAT(parse_toml("t = \"\U000F00C5\"", "t.toml").error().message, HasSubstr("t.toml:1: byte 0xF3"));
}

// A byte order mark is what some editors put in front; anywhere else U+FEFF is a letter like others.
TEST(TomlText, AByteOrderMarkIsPassedOver) {
  const auto table = parse_toml("\uFEFFa = 1\n", "t.toml");
  ASSERT_TRUE(table) << table.error().message;
  EXPECT_EQ((*table)["a"].value<int>(), 1);
  EXPECT_FALSE(parse_toml("a\uFEFF = 1\n", "t.toml"));
}

// 17 parts are allowed, 18 are not, however they are written; the dots of other keys, of numbers and in strings do not
// count. A million parts, unchecked, end the stack when the tables are destroyed.
TEST(TomlText, KeysHaveAFewPartsOnly) {
  const auto key = [](std::size_t parts, std::string_view part) {
    std::string text(part);
    for (std::size_t k = 1; k < parts; ++k) {
      text.append(k % 2 == 0 ? " . " : ".").append(part);
    }
    return text;
  };
  for (const std::string_view part : {"k", "'k.k'", "\"k\""}) {
    EXPECT_TRUE(parse_toml(fmt::format("{} = 1.5", key(17, part)), "t.toml")) << part;
    EXPECT_TRUE(parse_toml(fmt::format("[{}]", key(17, part)), "t.toml")) << part;
    for (const std::size_t parts : {18U, 1'000'000U}) {
      EXPECT_THAT(parse_toml(fmt::format("\n{} = 1", key(parts, part)), "t.toml").error().message,
                  ::testing::Eq("t.toml:2: a key of more than 17 parts"));
      EXPECT_FALSE(parse_toml(fmt::format("[[{}]]", key(parts, part)), "t.toml"));
      EXPECT_FALSE(parse_toml(fmt::format("a = [{{{} = 1}}]", key(parts, part)), "t.toml"));
    }
  }
  std::string numbers = "a = [0.5";
  for (int k = 0; k < 100; ++k) {
    numbers += ", 1.5";
  }
  EXPECT_TRUE(parse_toml(fmt::format("{}]", numbers), "t.toml"));
}

// toml++ quotes what it met, line ends and all.
// Arrays may begin a line as headers do, and hold anything.
TEST(TomlText, ArraysOnLinesOfTheirOwnAreNoHeaders) {
  const auto table =
      parse_toml("a = [\n  [\n    [.5e1 , 2],\n  ],\n[ {b = 1} ]\n]\n[ t ]\n[[ \"u v\" ]]\n[-x]\n", "t.toml");
  EXPECT_FALSE(table);  // .5 is no number of TOML: found by the parser, behind the look at headers
  EXPECT_THAT(table.error().message, ::testing::HasSubstr("t.toml:3"));
  const auto good =
      parse_toml("a = [\n  [\n    [0.5e1 , 2],\n  ],\n[ {b = 1} ]\n]\n[ t ]\n[[ \"u v\" ]]\n[-x]\n", "t.toml");
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_TRUE(good->contains("u v") && good->contains("-x"));
}

TEST(TomlText, ErrorsAreOneLine) {
  for (const char* text : {"a = [1,\n\n", "a = \"x\ny\"\n", "a = 1\na = 2\n", "a = \x01\n", "\n[\n]\n", "[=]\n",
                           "[[\n]]\n", " [ .a]\n", "[\t# no key\n]\n", "a = [[1], [2]]\n[[ {b} ]]\n", "[]\n", "["}) {
    const auto table = parse_toml(text, "t.toml");
    ASSERT_FALSE(table) << text;
    EXPECT_EQ(table.error().message.find('\n'), std::string::npos) << table.error().message;
    EXPECT_THAT(table.error().message, ::testing::StartsWith("t.toml:"));
  }
}

}  // namespace
}  // namespace selfcal
