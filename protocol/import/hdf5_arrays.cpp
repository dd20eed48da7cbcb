// HDF5 files of other programs, read in a child process: data sets by their paths, tables by their members.
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "protocol/import/array_source.hpp"
#include "protocol/recording/hdf5_handle.hpp"
#include "protocol/recording/isolated_parse.hpp"

namespace selfcal::import {
namespace {

using hdf5::Handle;

constexpr hsize_t most_numbers = hsize_t{1} << 32;

bool is_number(hid_t type) { return H5Tget_class(type) == H5T_INTEGER || H5Tget_class(type) == H5T_FLOAT; }

// "imu/accel" is imu.accel.
std::string dotted(std::string path) {
  std::replace(path.begin(), path.end(), '/', '.');
  return path;
}

// The text of an attribute that says a unit; empty: none.
std::string unit_of(hid_t dataset) {
  for (const char* name : {"units", "unit", "Units", "Unit"}) {
    if (H5Aexists(dataset, name) <= 0) {
      continue;
    }
    const Handle attribute(H5Aopen(dataset, name, H5P_DEFAULT), H5Aclose);
    const Handle type(attribute ? H5Aget_type(attribute.get()) : H5I_INVALID_HID, H5Tclose);
    constexpr std::size_t longest = 64;
    if (!type || H5Tget_class(type.get()) != H5T_STRING) {
      continue;
    }
    if (H5Tis_variable_str(type.get()) > 0) {
      const Handle memory(H5Tcopy(type.get()), H5Tclose);
      char* text = nullptr;
      const bool read = H5Aget_storage_size(attribute.get()) <= sizeof(hvl_t) &&
                        H5Aread(attribute.get(), memory.get(), static_cast<void*>(&text)) >= 0 && text != nullptr;
      std::string unit = read ? std::string(text).substr(0, longest) : std::string();
      H5free_memory(text);
      return unit;
    }
    const std::size_t size = H5Tget_size(type.get());
    std::string unit(size, '\0');
    if (size > 0 && size <= longest && H5Aget_storage_size(attribute.get()) == size &&
        H5Aread(attribute.get(), type.get(), unit.data()) >= 0) {
      return unit.substr(0, unit.find('\0'));
    }
  }
  return {};
}

struct Walk {
  std::string out;
  hsize_t numbers = 0;
};

void put_dataset(hid_t dataset, const std::string& path, Walk& walk) {
  const Handle space(H5Dget_space(dataset), H5Sclose), type(H5Dget_type(dataset), H5Tclose);
  std::array<hsize_t, 2> size{1, 1};
  const int rank = space ? H5Sget_simple_extent_ndims(space.get()) : -1;
  if (!type || rank < 1 || rank > 2 || H5Sget_simple_extent_dims(space.get(), size.data(), nullptr) != rank) {
    return;
  }
  const hsize_t count = size[0] * size[1];
  if (count == 0 || size[0] > most_numbers / size[1]) {
    return;
  }
  const std::string unit = unit_of(dataset);
  const auto put = [&](const std::string& name, hid_t memory) {
    walk.numbers += count;
    if (walk.numbers > most_numbers) {
      return;
    }
    std::vector<double> values(count);
    if (H5Dread(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0) {
      put_array(walk.out, unit.empty() ? name : fmt::format("{} [{}]", name, unit), NumberType::f8,
                {size[0], size[1], false},
                {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)});
    }
  };
  if (is_number(type.get())) {
    return put(dotted(path), H5T_NATIVE_DOUBLE);
  }
  const int members = H5Tget_class(type.get()) == H5T_COMPOUND && rank == 1 ? H5Tget_nmembers(type.get()) : 0;
  for (int k = 0; k < members; ++k) {
    const auto member = static_cast<unsigned>(k);
    const Handle own(H5Tget_member_type(type.get(), member), H5Tclose);
    char* name = H5Tget_member_name(type.get(), member);
    const Handle memory(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
    if (own && name != nullptr && is_number(own.get()) && H5Tinsert(memory.get(), name, 0, H5T_NATIVE_DOUBLE) >= 0) {
      put(dotted(path) + "." + name, memory.get());
    }
    H5free_memory(name);
  }
}

herr_t visit(hid_t group, const char* name, const H5O_info_t* info, void* data) {
  if (info->type == H5O_TYPE_DATASET) {
    const Handle dataset(H5Dopen2(group, name, H5P_DEFAULT), H5Dclose);
    if (dataset) {
      put_dataset(dataset.get(), name, *static_cast<Walk*>(data));
    }
  }
  return 0;
}

Expected<std::string> datasets_of(const std::string& file) {
  const hdf5::QuietErrors quiet;
  const Handle open(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!open) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot read as HDF5: {}", file, hdf5::last_error()));
  }
  Walk walk;
  if (H5Ovisit2(open.get(), H5_INDEX_NAME, H5_ITER_NATIVE, visit, &walk, H5O_INFO_BASIC) < 0) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot read as HDF5: {}", file, hdf5::last_error()));
  }
  if (walk.numbers > most_numbers) {
    return fail(ErrorKind::bad_input, fmt::format("{}: more than {} numbers", file, most_numbers));
  }
  return std::move(walk.out);
}

// "imu.accel [m/s^2].x" is imu.accel.x [m/s^2].
void units_last(Arrays& arrays) {
  for (RawColumn& column : arrays.columns) {
    const std::size_t begin = column.name.find(" ["), end = column.name.find(']', begin);
    if (begin != std::string::npos && end != std::string::npos) {
      const std::string unit = column.name.substr(begin, end + 1 - begin);
      column.name = column.name.substr(0, begin) + column.name.substr(end + 1) + unit;
    }
  }
}

}  // namespace

Expected<Arrays> read_hdf5_arrays(const std::filesystem::path& file) {
  Expected<std::string> bytes = bytes_isolated(file.string(), [&file] { return datasets_of(file.string()); });
  if (!bytes) {
    return tl::unexpected(bytes.error());
  }
  Arrays arrays;
  arrays.form = "HDF5";
  add_arrays(std::move(*bytes), arrays);
  units_last(arrays);
  return arrays;
}

}  // namespace selfcal::import
