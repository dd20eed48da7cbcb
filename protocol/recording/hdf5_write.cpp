#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/hdf5.hpp"
#include "protocol/recording/hdf5_handle.hpp"
#include "protocol/recording/text_value.hpp"

namespace selfcal {
namespace {

using hdf5::Handle;

constexpr hsize_t chunk_rows = 16384;  // 128 kB a column: large enough for deflate, small beside the 1 MB cache
constexpr unsigned deflate_level = 4;  // level 9 is 4 times slower for 2 % less
constexpr std::size_t image_increment = std::size_t{4} << 20;

bool write_text(hid_t file, const char* name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  // The library refuses strings of size 0: an empty one is a single NUL.
  if (H5Tset_size(type.get(), value.size() + 1) < 0 || H5Tset_cset(type.get(), H5T_CSET_UTF8) < 0) {
    return false;
  }
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(file, name, type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute && H5Awrite(attribute.get(), type.get(), value.c_str()) >= 0;
}

bool write_value(hid_t file, const char* name, hid_t file_type, hid_t memory_type, const void* value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(file, name, file_type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute && H5Awrite(attribute.get(), memory_type, value) >= 0;
}

bool write_number(hid_t file, const char* name, double value) {
  return write_value(file, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

// columns 0: shape [rows]; else [rows, columns].
bool write_dataset(hid_t file, const char* name, const double* values, hsize_t rows, hsize_t columns) {
  const int dimensions = columns == 0 ? 1 : 2;
  const std::array<hsize_t, 2> size{rows, columns};
  const std::array<hsize_t, 2> chunk{std::min(std::max<hsize_t>(rows, 1), chunk_rows), columns};
  const Handle space(H5Screate_simple(dimensions, size.data(), nullptr), H5Sclose);
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  if (H5Pset_chunk(layout.get(), dimensions, chunk.data()) < 0 || H5Pset_shuffle(layout.get()) < 0 ||
      H5Pset_deflate(layout.get(), deflate_level) < 0) {
    return false;
  }
  const Handle dataset(H5Dcreate2(file, name, H5T_IEEE_F64LE, space.get(), H5P_DEFAULT, layout.get(), H5P_DEFAULT),
                       H5Dclose);
  return dataset && H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0;
}

bool write_attributes(hid_t file, const Recording& recording) {
  return write_text(file, "format", std::string(recording_format)) &&
         write_value(file, "version", H5T_STD_I32LE, H5T_NATIVE_INT, &recording_version) &&
         write_text(file, "serial", recording.serial) &&
         write_number(file, "sample_rate_hz", recording.sample_rate_hz) &&
         write_number(file, "latitude_deg", recording.latitude_deg) &&
         write_number(file, "longitude_deg", recording.longitude_deg) &&
         write_number(file, "height_m", recording.height_m) &&
         (!recording.dwell_s || write_number(file, "dwell_s", *recording.dwell_s)) &&
         (!recording.rotation_s || write_number(file, "rotation_s", *recording.rotation_s)) &&
         (recording.start_time_utc.empty() || write_text(file, "start_time_utc", recording.start_time_utc)) &&
         (!recording.gimbal_absent || write_text(file, "gimbal", std::string(gimbal_absent_word)));
}

bool write_origin(hid_t file, const TextAttributes& origin) {
  return std::all_of(origin.begin(), origin.end(), [file](const auto& attribute) {
    return write_text(file, attribute.first.c_str(), attribute.second);
  });
}

bool write_datasets(hid_t file, const Recording& recording) {
  const hsize_t rows = recording.size();
  return write_dataset(file, "time_s", recording.time_s.data(), rows, 0) &&
         write_dataset(file, "delta_theta_rad", recording.delta_theta_rad.data()->data(), rows, 3) &&
         write_dataset(file, "delta_v_mps", recording.delta_v_mps.data()->data(), rows, 3) &&
         write_dataset(file, "gimbal_outer_rad", recording.gimbal_outer_rad.data(), rows, 0) &&
         write_dataset(file, "gimbal_inner_rad", recording.gimbal_inner_rad.data(), rows, 0) &&
         (recording.temperature_channels == 0 ||
          write_dataset(file, "temperature_c", recording.temperature_c.data(), rows,
                        recording.temperature_channels > 1 ? recording.temperature_channels : 0)) &&
         (recording.schedule_deg.empty() ||
          write_dataset(file, "schedule_deg", recording.schedule_deg.data()->data(), recording.schedule_deg.size(), 2));
}

// The whole file in memory: HDF5 never sees the disk, so a full one cannot leave it with half-written metadata, and
// the image is about a tenth of the samples it holds.
Expected<std::string> file_image(const Recording& recording, const TextAttributes& origin) {
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  const bool in_memory = H5Pset_fapl_core(access.get(), image_increment, false) >= 0;
  const Handle file(in_memory ? H5Fcreate("recording", H5F_ACC_TRUNC, H5P_DEFAULT, access.get()) : H5I_INVALID_HID,
                    H5Fclose);
  if (!file || !write_attributes(file.get(), recording) || !write_origin(file.get(), origin) ||
      !write_datasets(file.get(), recording) || H5Fflush(file.get(), H5F_SCOPE_GLOBAL) < 0) {
    return fail(ErrorKind::internal, hdf5::last_error());
  }
  const ssize_t size = H5Fget_file_image(file.get(), nullptr, 0);
  std::string image(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
  if (size <= 0 || H5Fget_file_image(file.get(), image.data(), image.size()) != size) {
    return fail(ErrorKind::internal, hdf5::last_error());
  }
  return image;
}

}  // namespace

Expected<void> write_hdf5(const Recording& recording, const std::filesystem::path& path, const TextAttributes& origin) {
  const hdf5::QuietErrors quiet;
  for (const std::size_t rows : {recording.delta_theta_rad.size(), recording.delta_v_mps.size(),
                                 recording.gimbal_outer_rad.size(), recording.gimbal_inner_rad.size()}) {
    if (rows != recording.size() || rows == 0) {
      return fail(ErrorKind::internal,
                  fmt::format("{}: recording with columns of {} and {} rows", path.string(), recording.size(), rows));
    }
  }
  const Expected<std::string> image = file_image(recording, origin);
  if (!image) {
    return fail(ErrorKind::internal, fmt::format("{}: cannot write as HDF5: {}", path.string(), image.error().message));
  }
  return write_file_atomically(path, *image);
}

}  // namespace selfcal
