// The HDF5 reader on files of any form that the library itself can write: the bytes choose types, shapes, storage,
// strings and values. (Files that the library cannot read are its own affair: the program reads in a child process,
// and hdf5_test damages whole images.)
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "protocol/recording/check.hpp"
#include "protocol/recording/hdf5_parse.hpp"

namespace {

// Takes the input apart; zeros once it is used up.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  std::uint8_t next() {
    if (left_ == 0) {
      return 0;
    }
    --left_;
    return *data_++;
  }
  double number() {
    constexpr std::array<double, 8> special = {0.0, 1.0, -1.0, 50.0, 1e300, -1e-300, 91.0, 40.0};
    const std::uint8_t byte = next();
    return byte < special.size() ? special[byte] : byte == 8 ? 0.0 / special[0] : (byte - 128) * 0.01 * next();
  }
  std::string text() {
    std::string value(next() % 40, ' ');
    std::generate(value.begin(), value.end(), [this] { return static_cast<char>(next()); });
    return value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

void put_string(hid_t file, const char* name, Bytes& bytes, const char* usual) {
  const std::uint8_t kind = bytes.next();
  const std::string value = kind % 4 == 3 ? bytes.text() : usual;
  const hid_t type = H5Tcopy(H5T_C_S1);
  const char* pointer = value.c_str();
  const bool variable = kind & 8;
  H5Tset_size(type, variable ? H5T_VARIABLE : value.size() + 1);
  if (kind & 16) {
    H5Tset_strpad(type, H5T_STR_SPACEPAD);
  }
  const hid_t space = kind & 32 ? H5Screate(H5S_NULL) : H5Screate(H5S_SCALAR);
  const hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  if (!(kind & 32)) {
    H5Awrite(attribute, type, variable ? static_cast<const void*>(&pointer) : value.c_str());
  }
  H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
}

void put_number(hid_t file, const char* name, Bytes& bytes, double usual) {
  const std::uint8_t kind = bytes.next();
  const std::array<double, 3> values = {kind % 4 == 3 ? bytes.number() : usual, 0.0, 0.0};
  const hsize_t count = kind & 8 ? 3 : 1;
  const hid_t space = kind & 16 ? H5Screate_simple(1, &count, nullptr) : H5Screate(H5S_SCALAR);
  const hid_t type = kind & 32 ? H5T_STD_I16BE : H5T_IEEE_F64LE;
  const hid_t attribute = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, H5T_NATIVE_DOUBLE, values.data());
  H5Aclose(attribute);
  H5Sclose(space);
}

void put_dataset(hid_t file, const char* name, Bytes& bytes, hsize_t usual_rows, hsize_t usual_columns) {
  const std::uint8_t kind = bytes.next();
  if (kind == 255) {
    return;  // missing
  }
  if (kind == 254) {
    H5Gclose(H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    return;
  }
  const hsize_t rows = kind & 1 ? bytes.next() : usual_rows;
  const hsize_t columns = kind & 2 ? bytes.next() % 5 : usual_columns;
  const std::array<hsize_t, 3> size = {rows, columns, 1};
  const int dimensions = kind & 4 ? bytes.next() % 4 : usual_columns > 0 ? 2 : 1;
  std::vector<double> values(std::max<std::size_t>(1, rows * std::max<hsize_t>(1, columns)));
  const double step = bytes.number();
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = kind & 8 ? bytes.number() : step * static_cast<double>(k + 1);
  }
  const hid_t space = dimensions == 0 ? H5Screate(H5S_SCALAR) : H5Screate_simple(dimensions, size.data(), nullptr);
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  if ((kind & 16) && dimensions > 0) {
    const std::array<hsize_t, 3> chunk = {1 + bytes.next() % 7U, 1, 1};
    H5Pset_chunk(layout, dimensions, chunk.data());
    H5Pset_deflate(layout, 1);
  }
  const hid_t type = kind & 32 ? H5T_IEEE_F32BE : kind & 64 ? H5T_STD_U8LE : H5T_IEEE_F64LE;
  const hid_t dataset = H5Dcreate2(file, name, type, space, H5P_DEFAULT, layout, H5P_DEFAULT);
  if (dataset >= 0) {
    H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(dataset);
  }
  H5Pclose(layout);
  H5Sclose(space);
}

std::string image_of(Bytes& bytes) {
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fapl_core(access, 1 << 16, false);
  const hid_t file = H5Fcreate("fuzz", H5F_ACC_TRUNC, H5P_DEFAULT, access);
  put_string(file, "format", bytes, "ins-selfcal-recording");
  put_string(file, "serial", bytes, "S");
  put_number(file, "version", bytes, 1);
  put_number(file, "sample_rate_hz", bytes, 50);
  put_number(file, "latitude_deg", bytes, 40);
  put_number(file, "longitude_deg", bytes, 0);
  put_number(file, "height_m", bytes, 0);
  const hsize_t rows = 2 + bytes.next();
  put_dataset(file, "time_s", bytes, rows, 0);
  put_dataset(file, "delta_theta_rad", bytes, rows, 3);
  put_dataset(file, "delta_v_mps", bytes, rows, 3);
  put_dataset(file, "gimbal_outer_rad", bytes, rows, 0);
  put_dataset(file, "gimbal_inner_rad", bytes, rows, 0);
  put_dataset(file, "temperature_c", bytes, rows, bytes.next() % 3);
  put_dataset(file, "schedule_deg", bytes, 3, 2);
  H5Fflush(file, H5F_SCOPE_GLOBAL);
  std::string image(static_cast<std::size_t>(std::max<ssize_t>(0, H5Fget_file_image(file, nullptr, 0))), '\0');
  H5Fget_file_image(file, image.data(), image.size());
  H5Fclose(file);
  H5Pclose(access);
  return image;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  Bytes bytes(data, size);
  const std::string image = image_of(bytes);
  const auto parsed = selfcal::hdf5::parse_image(image.data(), image.size(), "fuzz.h5");
  if (parsed) {
    const auto checked =
        selfcal::check_recording(*parsed, {.gaps_are_errors = false, .gimbal_contradiction_is_error = false});
    (void)checked;  // sound or not: it must return
  } else if (parsed.error().message.find('\n') != std::string::npos) {
    std::abort();
  }
  return 0;
}
