// Files as other programs write them: other storage, other types, and faults of form.
#include <gmock/gmock.h>
#include <hdf5.h>

#include <array>
#include <cstring>
#include <functional>

#include "protocol/recording/hdf5.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ForeignFile : public ::testing::Test {
 protected:
  void SetUp() override {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    ASSERT_TRUE(write_hdf5(recording, path));
  }
  void change(const std::function<void(hid_t)>& edit) const {
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(file, 0);
    edit(file);
    ASSERT_GE(H5Fclose(file), 0);
  }
  // Puts `values` in place of a dataset, in another type, chunked or not.
  static void put(hid_t file, const char* name, hid_t type, const std::vector<hsize_t>& size, const double* values,
                  hsize_t chunk = 0) {
    H5Ldelete(file, name, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr);
    const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
    if (chunk > 0) {
      std::vector<hsize_t> chunks = size;
      chunks[0] = chunk;
      ASSERT_GE(H5Pset_chunk(layout, static_cast<int>(size.size()), chunks.data()), 0);
      ASSERT_GE(H5Pset_fletcher32(layout), 0);
      ASSERT_GE(H5Pset_deflate(layout, 9), 0);
    }
    const hid_t dataset = H5Dcreate2(file, name, type, space, H5P_DEFAULT, layout, H5P_DEFAULT);
    ASSERT_GE(dataset, 0);
    ASSERT_GE(H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values), 0);
    H5Dclose(dataset);
    H5Pclose(layout);
    H5Sclose(space);
  }
  static void put_variable_string(hid_t file, const char* name, const char* value) {
    H5Adelete(file, name);
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    const hid_t space = H5Screate(H5S_SCALAR);
    const hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    ASSERT_GE(H5Awrite(attribute, type, &value), 0);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
  }
  // Not terminated, padded with spaces, in an array of one: as Fortran and MATLAB programs write.
  static void put_padded_string(hid_t file, const char* name, std::string value) {
    H5Adelete(file, name);
    value.resize(64, ' ');
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, value.size());
    H5Tset_strpad(type, H5T_STR_SPACEPAD);
    const hsize_t one = 1;
    const hid_t space = H5Screate_simple(1, &one, nullptr);
    const hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    ASSERT_GE(H5Awrite(attribute, type, value.data()), 0);
    H5Aclose(attribute);
    H5Sclose(space);
    H5Tclose(type);
  }
  std::string error() const {
    const auto read = read_hdf5(path);
    if (!read) {
      EXPECT_EQ(read.error().kind, ErrorKind::bad_input);
      EXPECT_THAT(read.error().message, HasSubstr(path.string()));
    }
    return read ? "no error" : read.error().message;
  }

  test::TemporaryFolder folder;
  std::filesystem::path path = folder / "r.h5";
  Recording recording = test::sample_recording();
  hsize_t rows = recording.size();
};

TEST_F(ForeignFile, SinglePrecisionBigEndianAndOddChunks) {
  change([&](hid_t file) {
    put(file, "delta_theta_rad", H5T_IEEE_F32BE, {rows, 3}, recording.delta_theta_rad.data()->data(), 7);
    put(file, "gimbal_outer_rad", H5T_IEEE_F32LE, {rows}, recording.gimbal_outer_rad.data());
  });
  const auto read = read_hdf5(path);
  ASSERT_TRUE(read) << read.error().message;
  for (std::size_t row = 0; row < rows; ++row) {
    EXPECT_EQ(read->recording.delta_theta_rad[row][1],
              static_cast<double>(static_cast<float>(recording.delta_theta_rad[row][1])));
  }
}

TEST_F(ForeignFile, VariableAndPaddedStrings) {
  change([&](hid_t file) {
    put_variable_string(file, "format", "ins-selfcal-recording");
    put_padded_string(file, "serial", "MATLAB-7");
  });
  const auto read = read_hdf5(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->recording.serial, "MATLAB-7");
}

TEST_F(ForeignFile, ExtraAttributesAndDatasetsAreIgnored) {
  change([&](hid_t file) {
    put(file, "something_else", H5T_IEEE_F64LE, {rows}, recording.time_s.data());
    H5Gclose(H5Gcreate2(file, "group", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  });
  EXPECT_EQ(error(), "no error");
}

TEST_F(ForeignFile, OneTemperatureChannelInOneDimension) {
  change([&](hid_t file) { put(file, "temperature_c", H5T_IEEE_F64LE, {rows}, recording.temperature_c.data()); });
  const auto read = read_hdf5(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->recording.temperature_channels, 1U);
}

TEST_F(ForeignFile, EachMissingDatasetIsNamed) {
  for (const char* name : {"time_s", "delta_theta_rad", "delta_v_mps", "gimbal_outer_rad", "gimbal_inner_rad"}) {
    ASSERT_TRUE(write_hdf5(recording, path));
    change([&](hid_t file) { H5Ldelete(file, name, H5P_DEFAULT); });
    EXPECT_THAT(error(), HasSubstr(std::string("dataset ") + name + " missing"));
  }
}

TEST_F(ForeignFile, EachMissingAttributeIsNamed) {
  for (const char* name :
       {"format", "version", "serial", "sample_rate_hz", "latitude_deg", "longitude_deg", "height_m"}) {
    ASSERT_TRUE(write_hdf5(recording, path));
    change([&](hid_t file) { H5Adelete(file, name); });
    EXPECT_THAT(error(), HasSubstr(std::string("attribute ") + name + " missing"));
  }
}

TEST_F(ForeignFile, WrongShapes) {
  change([&](hid_t file) {
    put(file, "delta_theta_rad", H5T_IEEE_F64LE, {rows, 2}, recording.delta_theta_rad.data()->data());
  });
  EXPECT_THAT(error(), AllOf(HasSubstr("delta_theta_rad"), HasSubstr("[1200, 2]"), HasSubstr("[N, 3] expected")));
  ASSERT_TRUE(write_hdf5(recording, path));
  change([&](hid_t file) { put(file, "time_s", H5T_IEEE_F64LE, {rows / 2, 2}, recording.time_s.data()); });
  EXPECT_THAT(error(), AllOf(HasSubstr("time_s"), HasSubstr("[600, 2]"), HasSubstr("[N] expected")));
  ASSERT_TRUE(write_hdf5(recording, path));
  change([&](hid_t file) { put(file, "gimbal_inner_rad", H5T_IEEE_F64LE, {rows - 5}, recording.time_s.data()); });
  EXPECT_THAT(error(), AllOf(HasSubstr("gimbal_inner_rad"), HasSubstr("1195 rows"), HasSubstr("1200")));
  ASSERT_TRUE(write_hdf5(recording, path));
  change([&](hid_t file) {
    put(file, "delta_v_mps", H5T_IEEE_F64LE, {rows / 2, 1, 2}, recording.delta_v_mps.data()->data());
  });
  EXPECT_THAT(error(), AllOf(HasSubstr("delta_v_mps"), HasSubstr("3 dimensions")));
}

TEST_F(ForeignFile, WrongKinds) {
  change([&](hid_t file) {
    H5Ldelete(file, "time_s", H5P_DEFAULT);
    H5Gclose(H5Gcreate2(file, "time_s", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  });
  EXPECT_THAT(error(), HasSubstr("dataset time_s"));
  ASSERT_TRUE(write_hdf5(recording, path));
  change([&](hid_t file) { put_variable_string(file, "latitude_deg", "40"); });
  EXPECT_THAT(error(), HasSubstr("attribute latitude_deg: not a number"));
  ASSERT_TRUE(write_hdf5(recording, path));
  change([&](hid_t file) { put_variable_string(file, "format", "something-else"); });
  EXPECT_THAT(error(), HasSubstr("attribute format: \"something-else\""));
  ASSERT_TRUE(write_hdf5(recording, path));
  change([&](hid_t file) { put_padded_string(file, "serial", "bell\a"); });
  EXPECT_THAT(error(), HasSubstr("attribute serial: control character 0x07"));
}

// A dataset that claims 10^12 rows and stores none: refused before memory is asked for.
TEST_F(ForeignFile, ImpossibleSizeIsRefused) {
  change([&](hid_t file) {
    H5Ldelete(file, "time_s", H5P_DEFAULT);
    const hsize_t size = 1'000'000'000'000;
    const hsize_t chunk = 1024;
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(layout, 1, &chunk);
    H5Dclose(H5Dcreate2(file, "time_s", H5T_IEEE_F64LE, space, H5P_DEFAULT, layout, H5P_DEFAULT));
    H5Pclose(layout);
    H5Sclose(space);
  });
  EXPECT_THAT(error(), AllOf(HasSubstr("time_s"), HasSubstr("1000000000000 rows")));
}

}  // namespace
}  // namespace selfcal
