// .npz and .mat, written by libzip and matio, with what damaged ones say.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <matio.h>
#include <zip.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>

#include "protocol/import/column_source.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t rows = 5;

void write_mat(const std::string& file, mat_ft version) {
  mat_t* mat = Mat_CreateVer(file.c_str(), nullptr, version);
  ASSERT_NE(mat, nullptr);
  const auto put = [mat](const char* name, matio_classes kind, matio_types type, std::size_t columns, void* data) {
    std::size_t size[2] = {rows, columns};
    matvar_t* variable = Mat_VarCreate(name, kind, type, 2, size, data, 0);
    ASSERT_EQ(Mat_VarWrite(mat, variable, MAT_COMPRESSION_ZLIB), 0);
    Mat_VarFree(variable);
  };
  double t[rows] = {0.1, 0.2, 0.3, 0.4, 0.5};
  put("t", MAT_C_DOUBLE, MAT_T_DOUBLE, 1, t);
  float gyro[3 * rows];
  for (std::size_t k = 0; k < 3 * rows; ++k) {
    gyro[k] = static_cast<float>(k);
  }
  put("gyro", MAT_C_SINGLE, MAT_T_SINGLE, 3, gyro);
  std::int16_t counts[rows] = {-1, 2, -3, 4, -5};
  put("counts", MAT_C_INT16, MAT_T_INT16, 1, counts);
  Mat_Close(mat);
}

class Archives : public ::testing::Test {
 protected:
  const test::TemporaryFolder folder_;
};

TEST_F(Archives, MatOfEachVersion) {
  for (const mat_ft version : {MAT_FT_MAT5, MAT_FT_MAT73}) {
    const std::string file = (folder_ / fmt::format("a{}.mat", static_cast<int>(version))).string();
    write_mat(file, version);
    const auto source = open_columns(file);
    ASSERT_TRUE(source) << source.error().message;
    // Version 7.3 keeps no order.
    const std::vector<std::string>& names = (*source)->names();
    ASSERT_THAT(names, ::testing::UnorderedElementsAre("t", "gyro.x", "gyro.y", "gyro.z", "counts"));
    const auto place = [&names](const char* name) {
      return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    };
    ColumnRequest request;
    request.columns = {place("gyro.y"), place("counts")};
    request.stamp = place("t");
    const auto data = (*source)->read(request);
    ASSERT_TRUE(data) << data.error().message;
    EXPECT_THAT(data->values[0], ElementsAre(5, 6, 7, 8, 9));  // column-major
    EXPECT_THAT(data->values[1], ElementsAre(-1, 2, -3, 4, -5));
    EXPECT_EQ(static_cast<double>(data->stamps[2]), 0.3);
  }
}

// Bytes altered and files cut off at random: an answer or one line, never a death of ours.
TEST_F(Archives, DamagedMatIsAnErrorAtWorst) {
  const std::string file = (folder_ / "a.mat").string();
  write_mat(file, MAT_FT_MAT5);
  std::ifstream in(file, std::ios::binary);
  const std::string sound((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::mt19937 random(7);
  for (int trial = 0; trial < 60; ++trial) {
    std::string damaged = sound;
    for (int k = 0; k < 3; ++k) {
      damaged[128 + random() % (sound.size() - 128)] = static_cast<char>(random());
    }
    damaged.resize(trial % 3 == 0 ? random() % sound.size() : sound.size());
    std::ofstream(folder_ / "b.mat", std::ios::binary) << damaged;
    const auto source = open_columns(folder_ / "b.mat");
    if (!source) {
      EXPECT_THAT(source.error().message, HasSubstr("b.mat"));
      EXPECT_EQ(source.error().message.find('\n'), std::string::npos);
    }
  }
}

std::string npy_of(const std::string& data, std::size_t count) {
  std::string header = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}", count);
  header.resize(117, ' ');
  header += '\n';
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + data;
}

TEST_F(Archives, NpzWithArraysOfSeveralLengths) {
  const std::string file = (folder_ / "a.npz").string();
  const double values[rows] = {1, 2, 3, 4, 5};
  const std::string five = npy_of(std::string(reinterpret_cast<const char*>(values), sizeof values), rows);
  const std::string one = npy_of(std::string(reinterpret_cast<const char*>(values), sizeof *values), 1);
  int code = 0;
  zip_t* zip = zip_open(file.c_str(), ZIP_CREATE, &code);
  ASSERT_NE(zip, nullptr);
  for (const auto& [name, contents] :
       {std::pair{"time.npy", &five}, std::pair{"ax.npy", &five}, std::pair{"fs.npy", &one}}) {
    zip_file_add(zip, name, zip_source_buffer(zip, contents->data(), contents->size(), 0), 0);
  }
  ASSERT_EQ(zip_close(zip), 0);
  const auto source = open_columns(file);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->names(), ElementsAre("time", "ax"));
  EXPECT_THAT((*source)->form(), HasSubstr("left out for their length: fs (1)"));
  std::ifstream in(file, std::ios::binary);
  const std::string sound((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::ofstream(folder_ / "b.npz", std::ios::binary) << sound.substr(0, sound.size() / 2);
  const auto cut = open_columns(folder_ / "b.npz");
  ASSERT_FALSE(cut);
  EXPECT_THAT(cut.error().message, HasSubstr("cannot read as .npz"));
}

}  // namespace
}  // namespace selfcal::import
