// Files by what they hold: NumPy, what is hostile or not meant.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>

#include "protocol/import/array_source.hpp"
#include "protocol/import/guess.hpp"
#include "protocol/import/import_map.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string npy(const std::string& header, const std::string& data) {
  std::string padded = header;
  padded.resize((10 + header.size() + 1 + 63) / 64 * 64 - 11, ' ');
  padded += '\n';
  std::string image = "\x93NUMPY";
  image += std::string("\x01\x00", 2);
  image += static_cast<char>(padded.size() & 0xFF);
  image += static_cast<char>(padded.size() >> 8U);
  return image + padded + data;
}

template <typename Number>
std::string bytes(std::initializer_list<Number> numbers) {
  std::string out;
  for (const Number number : numbers) {
    out.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  return out;
}

class Source : public ::testing::Test {
 protected:
  Expected<std::unique_ptr<ColumnSource>> open(const std::string& contents, const char* name = "file") {
    std::ofstream(folder_ / name, std::ios::binary) << contents;
    return open_columns(folder_ / name);
  }
  std::string fault(const std::string& contents) {
    const auto source = open(contents);
    return source ? std::string() : source.error().message;
  }
  const test::TemporaryFolder folder_;
};

TEST_F(Source, RowsOfTwoSensorsAreToldFromAFlagThatChanges) {
  std::string mixed = "time,sensor,x,y,z\n", flagged = mixed;
  for (int k = 0; k < 200; ++k) {
    mixed += fmt::format("{},{},1,2,3\n", 0.01 * k, k % 2 == 0 ? "ACC" : "GYR");
    flagged += fmt::format("{},{},1,2,3\n", 0.01 * k, k < 150 ? "FIX" : "FLOAT");
  }
  const auto rows = open(mixed);
  ASSERT_TRUE(rows);
  EXPECT_THAT((*rows)->mixed_rows(), HasSubstr("column 2 (sensor) tells apart: ACC, GYR"));
  const auto one = open(flagged);
  ASSERT_TRUE(one);
  EXPECT_EQ((*one)->mixed_rows(), "");
}

// Two rows of a table are not two sensors that take turns.
TEST_F(Source, FewRowsWithWordsAreNoSensors) {
  const auto source = open("who,n,mean,std\nHealthy,520,12.8,6.1\nPD,519,12.9,4.7\n");
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->mixed_rows(), "");
}

TEST_F(Source, JsonInOnePieceSaysWhatMakesLinesOfIt) {
  EXPECT_THAT(fault("{\"Meas\":{\"IMU9\":[{\"x\":0.03},{\"x\":0.04}]}}\n"), HasSubstr("jq -c '.NAME[]'"));
  EXPECT_THAT(fault("[{\"x\":0.03},\n{\"x\":0.04}]\n"), HasSubstr("jq -c '.[]'"));
}

// Empatica's E4: when it began and how many rows a second it holds stand where the numbers stand, once for each column.
TEST_F(Source, TheTwoLinesBeforeAWristbandsNumbersAreNone) {
  const auto source = open(
      "1544027337.000000, 1544027337.000000, 1544027337.000000\n32.000000, 32.000000, 32.000000\n"
      "-20,30,51\n-21,31,50\n");
  ASSERT_TRUE(source);
  ColumnRequest request;
  request.columns = {0, 1, 2};
  request.most_rows = 10;
  const auto data = (*source)->read(request);
  ASSERT_TRUE(data);
  EXPECT_EQ(data->rows, 2U);
  EXPECT_EQ(data->values[2].front(), 51.0);
}

// Two sensors with biases of their own take turns; a flag of new data beside one sensor does so too, and tells nothing apart.
TEST_F(Source, RowsOfNumberedSensorsAreToldByWhatTheyRead) {
  std::string mixed = "time,I,x,y,z\n", flagged = mixed;
  for (int k = 0; k < 600; ++k) {
    const double noise = 1e-3 * std::sin(37.0 * k), x = std::sin(0.01 * k);
    mixed +=
        fmt::format("{},{},{},{},{}\n", 0.01 * k, k % 2, x + 0.1 * (k % 2) + noise, 2.0 - 0.2 * (k % 2) - noise, 1.0);
    flagged += fmt::format("{},{},{},{},{}\n", 0.01 * k, k % 2, x + noise, 2.0 - noise, 1.0);
  }
  const auto rows = open(mixed);
  ASSERT_TRUE(rows);
  EXPECT_THAT((*rows)->mixed_rows(), HasSubstr("column 2 (I) tells apart: 0, 1"));
  const auto one = open(flagged);
  ASSERT_TRUE(one);
  EXPECT_EQ((*one)->mixed_rows(), "");
}

TEST_F(Source, NpyByRowsAndByColumns) {
  for (const bool fortran : {false, true}) {
    const auto source =
        open(npy(fmt::format("{{'descr': '<f8', 'fortran_order': {}, 'shape': (2, 3), }}", fortran ? "True" : "False"),
                 fortran ? bytes<double>({1, 4, 2, 5, 3, 6}) : bytes<double>({1, 2, 3, 4, 5, 6})));
    ASSERT_TRUE(source) << source.error().message;
    ColumnRequest request;
    request.columns = {2, 0};
    const auto data = (*source)->read(request);
    ASSERT_TRUE(data) << data.error().message;
    EXPECT_THAT(data->values[0], ElementsAre(3, 6));
    EXPECT_THAT(data->values[1], ElementsAre(1, 4));
  }
}

TEST_F(Source, NpyOfRecordsAndBigEndianAndWholeNumbers) {
  // 't' big-endian int64, 'g' two float32
  std::string data;
  for (const std::int64_t t : {std::int64_t{1709164800000000001}, std::int64_t{1709164800000000002}}) {
    std::string number = bytes<std::int64_t>({t});
    std::reverse(number.begin(), number.end());
    data += number + bytes<float>({0.5F, -2.0F});
  }
  const auto source =
      open(npy("{'descr': [('t', '>i8'), ('g', '<f4', (2,))], 'fortran_order': False, 'shape': (2,), }", data));
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->names(), ElementsAre("t", "g.1", "g.2"));
  ColumnRequest request;
  request.columns = {2};
  request.stamp = 0;
  const auto read = (*source)->read(request);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_THAT(read->values[0], ElementsAre(-2, -2));
  EXPECT_EQ(read->stamps[1] - read->stamps[0], 1.0L);  // a double has steps of 256 here
}

TEST_F(Source, NpyThatAnnouncesMoreThanItHas) {
  EXPECT_THAT(fault(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (4611686018427387904, 4), }", "12345678")),
              HasSubstr("8 bytes; 4611686018427387904 x 4 numbers of 8 bytes are announced"));
  EXPECT_THAT(fault(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3, 4), }", "")),
              HasSubstr("one or two dimensions"));
  EXPECT_THAT(fault(npy("{'descr': '|O', 'fortran_order': False, 'shape': (3,), }", bytes<double>({1, 2, 3}))),
              HasSubstr("file"));
  EXPECT_THAT(fault(npy("{'descr'", "")), HasSubstr("holds no array"));
  EXPECT_THAT(fault("\x93NUMPY"), HasSubstr("no .npy array, or cut off"));
}

TEST_F(Source, WhatIsNoTextSaysWhatItIs) {
  EXPECT_THAT(fault(std::string("\xFF\xFE"
                                "1\0,\0",
                                6)),
              HasSubstr("UTF-16"));
  EXPECT_THAT(fault(std::string("1,2\0,3\n", 7)), HasSubstr("holds a byte 0"));
  EXPECT_THAT(fault("\x89MCAP0\r\n"), HasSubstr("MCAP"));
  EXPECT_THAT(fault("#ROSBAG V2.0\n"), HasSubstr("ROS 1 bag"));
  EXPECT_THAT(fault("\x89HDF\r\n\x1A\n"), HasSubstr("HDF5"));
  EXPECT_THAT(fault("hello\nworld\n"), HasSubstr("no lines of numbers"));
  EXPECT_THAT(fault(""), HasSubstr("no lines of numbers"));
  EXPECT_THAT(fault(std::string((1 << 20) + (1 << 19), '1')), HasSubstr("line 1: longer than"));
  for (const char* damaged : {"PK\x03\x04 and nothing", "MATLAB 5.0 MAT-file and nothing"}) {
    EXPECT_THAT(fault(damaged), HasSubstr("file"));
  }
}

TEST_F(Source, GzipIsReadAsTheTextInIt) {
  const std::string name = (folder_ / "plain.csv").string();
  std::ofstream(name) << "a,b\n1,2\n3,4\n";
  ASSERT_EQ(std::system(("gzip " + name).c_str()), 0);
  const auto source = open_columns(folder_ / "plain.csv.gz");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->names(), ElementsAre("a", "b"));
}

// Bytes altered, doubled and dropped at random: a guess, or one line; never a death. `asan-ubsan` watches the memory.
TEST_F(Source, MutatedTextsAreGuessedOrRefused) {
  std::string sound = "time [s];gx [deg/s];gy;gz;ax [g];ay;az;outer [deg];inner;temp\n";
  for (int k = 0; k < 260; ++k) {
    const double turn = k < 100 ? 0.0 : k < 200 ? 0.9 * (k - 100) : 90.0;
    sound += fmt::format("{};{};0,1;-0,2;0,01;{};0,02;{};0;20,5\n", k, k % 7, k % 3, turn);
  }
  std::mt19937 random(11);
  constexpr std::string_view letters = "0123456789,;.\t\n#%\"-+eE \r\x00\xEF\xBB:nai";
  for (int trial = 0; trial < 150; ++trial) {
    std::string text = sound;
    for (int k = 0; k < 1 + trial % 40; ++k) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0: text[at] = letters[random() % letters.size()]; break;
        case 1: text.insert(at, text.substr(random() % text.size(), random() % 200)); break;
        case 2: text.erase(at, random() % 200); break;
        default: text[at] = static_cast<char>(random()); break;
      }
    }
    const auto source = open(text);
    const auto guess = source ? guess_map(**source, {}, "file") : tl::unexpected(source.error());
    if (!guess) {
      EXPECT_EQ(guess.error().message.find('\n'), std::string::npos);
      EXPECT_EQ(guess.error().kind, ErrorKind::bad_input);
      continue;
    }
    // A guess's map is always a map.
    const std::string map = format_import_map(guess->map, {}, "");
    const auto read = parse_import_map(map, "map");
    EXPECT_TRUE(read) << read.error().message << "\n" << map;
  }
}

}  // namespace
}  // namespace selfcal::import
