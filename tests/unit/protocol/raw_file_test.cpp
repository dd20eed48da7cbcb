// Names of files that are pages of raw data.
#include <gtest/gtest.h>

#include "protocol/profile/raw_file.hpp"

namespace selfcal::profile {
namespace {

TEST(RawFile, NamesThePage) {
  EXPECT_EQ(file_name("/raw/{run}/{page:6}.bin", 3, 7), "/raw/3/000007.bin");
  EXPECT_EQ(file_name("p{page}", 3, 4'294'967'295), "p4294967295");
  EXPECT_EQ(file_name("{page:2}{run:3}", 12, 345), "345012");
}

// Each page's name is that of no other page.
TEST(RawFile, TheNameTellsThePageBack) {
  for (const std::string_view pattern :
       {"/raw/{run}/{page:6}.bin", "{page}", "r{run}p{page}", "{page}{run}", "{page:10}-{run:4}"}) {
    ASSERT_EQ(fault_of_file_pattern(pattern), "");
    for (const std::uint32_t page : {0U, 1U, 9U, 10U, 99U, 12'345U, 999'999U, 1'000'000U, 4'294'967'295U}) {
      EXPECT_EQ(page_of_file(pattern, 12, file_name(pattern, 12, page)), page) << pattern;
    }
  }
  constexpr std::string_view pattern = "/raw/{run}/{page:6}.bin";
  EXPECT_EQ(page_of_file(pattern, 3, "/raw/3/000007.bin"), 7U);
  for (const std::string_view other : {"/raw/4/000007.bin", "/raw/3/7.bin", "/raw/3/0000007.bin", "/raw/3/000007.bi",
                                       "", "/raw/3/000007.bin2", "/raw/3/-00007.bin", "/raw/3/4294967296.bin"}) {
    EXPECT_EQ(page_of_file(pattern, 3, other), std::nullopt) << other;
  }
}

TEST(RawFile, APatternHasThePageOnce) {
  for (const std::string_view wrong :
       {"", "/raw/7.bin", "{page}{page}", "{page", "page}", "{page}}", "{number}", "{page:0}", "{page:11}", "{page:x}",
        "{page:}", "{page} .bin", "{page}\n", "{{page}}"}) {
    EXPECT_NE(fault_of_file_pattern(wrong), "") << wrong;
  }
  EXPECT_NE(fault_of_file_pattern(std::string(195, 'a') + "{page}"), "");
  EXPECT_EQ(fault_of_file_pattern(std::string(194, 'a') + "{page}"), "");
}

}  // namespace
}  // namespace selfcal::profile
