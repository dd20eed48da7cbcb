#include "protocol/toml_file/nearest_word.hpp"

#include <gtest/gtest.h>

#include <array>

namespace selfcal {
namespace {

// Distances worked out by hand: each operation counts one.
TEST(EditDistance, InsertionsDeletionsReplacementsAndSwaps) {
  EXPECT_EQ(edit_distance("", ""), 0U);
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);  // k-s, e-i, +g
  EXPECT_EQ(edit_distance("estimte", "estimate"), 1U);
  EXPECT_EQ(edit_distance("decdoe", "decode"), 1U);  // neighbours swapped
  EXPECT_EQ(edit_distance("ca", "abc"), 3U);         // of strings aligned: no letter is edited twice
  for (const char* a : {"gyro", "accel", "x"}) {
    for (const char* b : {"gyros", "axel", ""}) {
      EXPECT_EQ(edit_distance(a, b), edit_distance(b, a));
    }
  }
}

TEST(DidYouMean, TheNearestWithinAThirdOfTheLetters) {
  const std::array<std::string_view, 3> known = {"horizontal", "table2", "json"};
  EXPECT_EQ(did_you_mean("horizontl", known), "; did you mean horizontal?");
  EXPECT_EQ(did_you_mean("tabel2", known), "; did you mean table2?");
  EXPECT_EQ(did_you_mean("jsn", known), "; did you mean json?");
  EXPECT_EQ(did_you_mean("xml", known), "");
  EXPECT_EQ(did_you_mean("w", std::array<std::string_view, 2>{"x", "id"}), "");  // nothing in common
  EXPECT_EQ(did_you_mean(std::string(1'000'000, 'j'), known), "");               // and does not take for ever
}

}  // namespace
}  // namespace selfcal
