// NovAtel's ASCII logs; the lines are the examples of the manual.
#include "protocol/import/novatel.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::HasSubstr;

constexpr const char* rawimus =
    "%RAWIMUSA,2209,491612.254;2209,491612.253588,ea5afe00,329303960,-2512321,4410363,309705,607017,-1009773*1fb76c28";
constexpr const char* rawimusx =
    "%RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,-1000837*"
    "038422a7";
constexpr const char* rawimux =
    "#RAWIMUXA,USB1,0,64.5,FINESTEERING,2209,491740.110,02000020,0dc5,16809;04,41,2209,491740.109817,ea57fe00,"
    "329394068,"
    "-2396829,4481425,321199,257329,-936077*cf9c035d";
constexpr const char* corrected =
    "%IMURATECORRIMUSA,2010,298810.100;2010,298810.078576000,0.000105592,-0.000227975,-0.000027416,-0.002454522,"
    "-0.000917886,-0.004175763*c5aaf2e6";

class Novatel : public ::testing::Test {
 protected:
  Expected<std::unique_ptr<ColumnSource>> open(const std::vector<std::string>& lines) {
    std::ofstream file(folder_ / "log.gps", std::ios::binary);
    for (const std::string& line : lines) {
      file << line << "\r\n";
    }
    file.close();
    return open_novatel(folder_ / "log.gps");
  }
  static ColumnRequest all() {
    ColumnRequest request;
    request.columns = {1, 2, 3, 4, 5, 6, 7};
    request.stamp = 0;
    return request;
  }
  test::TemporaryFolder folder_;
};

TEST_F(Novatel, ReadsItsThreeForms) {
  for (const auto& [line, seconds, status, values] :
       {std::tuple{rawimus, 491612.253588L, 0xEA5AFE00,
                   std::array{4410363, 2512321, 329303960, -1009773, -607017, 309705}},
        std::tuple{rawimusx, 491674.013699L, 0xEA59FE00,
                   std::array{4508389, 2706935, 329308016, -1000837, -417138, 196192}},
        std::tuple{rawimux, 491740.109817L, 0xEA57FE00,
                   std::array{4481425, 2396829, 329394068, -936077, -257329, 321199}}}) {
    const auto source = open({"[COM1]<OK", corrected, line});
    ASSERT_TRUE(source && *source) << line;
    const auto data = (*source)->read(all());
    ASSERT_TRUE(data) << data.error().message;
    ASSERT_EQ(data->rows, 1U);
    EXPECT_NEAR(static_cast<double>(data->stamps[0] - 2209 * 604800.0L - seconds), 0.0, 1e-9);
    EXPECT_EQ(data->values[0][0], static_cast<double>(status));
    for (std::size_t k = 0; k < values.size(); ++k) {
      EXPECT_EQ(data->values[k + 1][0], values.at(k)) << line << " " << k;
    }
    EXPECT_EQ(data->place(0), "line 3");
  }
}

TEST_F(Novatel, ADamagedLineIsAnErrorOrNoNumber) {
  std::string damaged = rawimus;
  damaged[40] = damaged[40] == '1' ? '2' : '1';
  const auto source = open({rawimus, damaged, std::string(rawimus).substr(0, 80), rawimus});
  ASSERT_TRUE(source && *source);
  ColumnRequest request = all();
  const auto strict = (*source)->read(request);
  ASSERT_FALSE(strict);
  EXPECT_THAT(strict.error().message, HasSubstr("line 2: RAWIMUSA: the checksum"));
  request.tolerant = true;
  const auto data = (*source)->read(request);
  ASSERT_TRUE(data);
  ASSERT_EQ(data->rows, 4U);
  EXPECT_TRUE(std::isnan(data->stamps[1]) && std::isnan(data->values[1][1]));
  EXPECT_TRUE(std::isnan(data->stamps[2]) && std::isnan(data->values[6][2]));
  EXPECT_EQ(data->values[1][3], 4410363);
}

TEST_F(Novatel, SaysWhatItIsInTheirPlace) {
  const auto filtered = open({corrected});
  ASSERT_FALSE(filtered);
  EXPECT_THAT(filtered.error().message, HasSubstr("IMURATECORRIMUSA: the receiver has taken gravity"));
  std::string damaged = rawimus;
  damaged.back() = '0';
  const auto none_sound = open({damaged, corrected});
  ASSERT_FALSE(none_sound);
  EXPECT_THAT(none_sound.error().message, HasSubstr("line 1: RAWIMUSA: the checksum"));
}

TEST_F(Novatel, OtherTextsAreNone) {
  for (const char* line :
       {"#t,ax;ay*", "% a,b;c", "#A", "%", "", "# NAMEA,1;2*00000000", "#timestamp [ns],w_x [rad s^-1];1"}) {
    const auto source = open({line, line});
    ASSERT_TRUE(source) << line;
    EXPECT_FALSE(*source) << line;
  }
}

}  // namespace
}  // namespace selfcal::import
