#include "protocol/recording/hdf5_parse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "protocol/recording/hdf5_handle.hpp"
#include "protocol/recording/text_value.hpp"

namespace selfcal {
namespace {

using hdf5::Handle;

// 24 h at 2000 Hz, the most that the estimator is meant for.
constexpr hsize_t most_rows = hsize_t{24} * 3600 * 2000;
constexpr hsize_t most_positions = 4096;
constexpr hsize_t most_temperature_channels = 64;
constexpr std::size_t longest_string = 4096;

class Reader {
 public:
  Reader(hid_t file, const std::string& name) : file_(file), name_(name) {}

  Expected<Recording> read();

 private:
  template <typename... Arguments>
  tl::unexpected<Error> bad(fmt::format_string<Arguments...> format, Arguments&&... arguments) const {
    return fail(ErrorKind::bad_input, name_ + ": " + fmt::format(format, std::forward<Arguments>(arguments)...));
  }
  bool has_attribute(const char* attribute) const { return H5Aexists(file_, attribute) > 0; }
  bool has_dataset(const char* dataset) const { return H5Lexists(file_, dataset, H5P_DEFAULT) > 0; }

  Expected<Handle> open_scalar(const char* attribute) const;
  Expected<double> number(const char* attribute) const;
  Expected<std::string> text(const char* attribute) const;
  Expected<void> read_attributes(Recording& recording) const;
  Expected<void> check_format() const;

  struct Shape {
    hsize_t rows = 0;
    hsize_t columns = 1;
    int dimensions = 1;
  };
  Expected<Handle> open_dataset(const char* dataset, Shape& shape) const;
  Expected<void> transfer(const Handle& opened, const char* dataset, double* to) const;
  Expected<std::vector<double>> column(const char* dataset) const;
  template <std::size_t Columns>
  Expected<std::vector<std::array<double, Columns>>> table(const char* dataset, hsize_t row_limit) const;
  Expected<void> read_temperature(Recording& recording) const;

  hid_t file_;
  const std::string& name_;
};

Expected<Handle> Reader::open_scalar(const char* attribute) const {
  if (!has_attribute(attribute)) {
    constexpr std::string_view no_recording =
        ": no recording of this program; `selfcal import --guess` and `selfcal poses` read the arrays of others";
    return bad("attribute {} missing{}", attribute, std::string_view(attribute) == "format" ? no_recording : "");
  }
  Handle opened(H5Aopen(file_, attribute, H5P_DEFAULT), H5Aclose);
  const Handle space(opened ? H5Aget_space(opened.get()) : H5I_INVALID_HID, H5Sclose);
  if (!space) {
    return bad("attribute {}: {}", attribute, hdf5::last_error());
  }
  if (H5Sget_simple_extent_npoints(space.get()) != 1) {
    return bad("attribute {}: {} values, one expected", attribute, H5Sget_simple_extent_npoints(space.get()));
  }
  return opened;
}

Expected<double> Reader::number(const char* attribute) const {
  const Expected<Handle> opened = open_scalar(attribute);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  const Handle type(H5Aget_type(opened->get()), H5Tclose);
  const H5T_class_t type_class = H5Tget_class(type.get());
  if (type_class != H5T_FLOAT && type_class != H5T_INTEGER) {
    return bad("attribute {}: not a number", attribute);
  }
  double value = 0.0;
  if (H5Aread(opened->get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    return bad("attribute {}: {}", attribute, hdf5::last_error());
  }
  if (!std::isfinite(value)) {
    return bad("attribute {}: {} is not a finite number", attribute, value);
  }
  return value;
}

Expected<std::string> Reader::text(const char* attribute) const {
  const Expected<Handle> opened = open_scalar(attribute);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  const Handle type(H5Aget_type(opened->get()), H5Tclose);
  if (H5Tget_class(type.get()) != H5T_STRING) {
    return bad("attribute {}: not a string", attribute);
  }
  std::string value;
  if (H5Tis_variable_str(type.get()) > 0) {
    char* read = nullptr;
    if (H5Aread(opened->get(), type.get(), &read) < 0 || read == nullptr) {
      return bad("attribute {}: {}", attribute, hdf5::last_error());
    }
    value.assign(read, strnlen(read, longest_string + 1));
    H5free_memory(read);
  } else {
    const std::size_t size = H5Tget_size(type.get());
    if (size > longest_string) {
      return bad("attribute {}: {} bytes, at most {} allowed", attribute, size, longest_string);
    }
    std::vector<char> buffer(size + 1, '\0');
    if (H5Aread(opened->get(), type.get(), buffer.data()) < 0) {
      return bad("attribute {}: {}", attribute, hdf5::last_error());
    }
    value.assign(buffer.data(), strnlen(buffer.data(), size));
    value.erase(value.find_last_not_of(' ') + 1);  // space-padded strings
  }
  if (const auto fault = text_fault(value)) {
    return bad("attribute {}: {}", attribute, *fault);
  }
  return value;
}

Expected<void> Reader::check_format() const {
  const Expected<std::string> format = text("format");
  if (!format) {
    return tl::unexpected(format.error());
  }
  if (*format != recording_format) {
    return bad("attribute format: \"{}\", \"{}\" expected", *format, recording_format);
  }
  const Expected<double> version = number("version");
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version != recording_version) {
    return bad("attribute version: {}, {} expected", *version, recording_version);
  }
  return {};
}

Expected<void> Reader::read_attributes(Recording& recording) const {
  struct Number {
    const char* name;
    double* to;
  };
  for (const auto& [attribute, to] :
       {Number{"sample_rate_hz", &recording.sample_rate_hz}, Number{"latitude_deg", &recording.latitude_deg},
        Number{"longitude_deg", &recording.longitude_deg}, Number{"height_m", &recording.height_m}}) {
    const Expected<double> value = number(attribute);
    if (!value) {
      return tl::unexpected(value.error());
    }
    *to = *value;
  }
  struct OptionalNumber {
    const char* name;
    std::optional<double>* to;
  };
  for (const auto& [attribute, to] :
       {OptionalNumber{"dwell_s", &recording.dwell_s}, OptionalNumber{"rotation_s", &recording.rotation_s}}) {
    if (has_attribute(attribute)) {
      const Expected<double> value = number(attribute);
      if (!value) {
        return tl::unexpected(value.error());
      }
      *to = *value;
    }
  }
  Expected<std::string> serial = text("serial");
  if (!serial) {
    return tl::unexpected(serial.error());
  }
  recording.serial = std::move(*serial);
  if (has_attribute("start_time_utc")) {
    Expected<std::string> start = text("start_time_utc");
    if (!start) {
      return tl::unexpected(start.error());
    }
    recording.start_time_utc = std::move(*start);
  }
  if (has_attribute("gimbal")) {
    const Expected<std::string> gimbal = text("gimbal");
    if (!gimbal) {
      return tl::unexpected(gimbal.error());
    }
    recording.gimbal_absent = *gimbal == gimbal_absent_word;
  }
  return {};
}

Expected<Handle> Reader::open_dataset(const char* dataset, Shape& shape) const {
  if (!has_dataset(dataset)) {
    return bad("dataset {} missing", dataset);
  }
  Handle opened(H5Dopen2(file_, dataset, H5P_DEFAULT), H5Dclose);
  if (!opened) {
    return bad("dataset {}: {}", dataset, hdf5::last_error());
  }
  const Handle type(H5Dget_type(opened.get()), H5Tclose);
  const H5T_class_t type_class = type ? H5Tget_class(type.get()) : H5T_NO_CLASS;
  if (type_class != H5T_FLOAT && type_class != H5T_INTEGER) {
    return bad("dataset {}: holds no numbers", dataset);
  }
  const Handle space(H5Dget_space(opened.get()), H5Sclose);
  constexpr int most_dimensions = 2;
  std::array<hsize_t, H5S_MAX_RANK> sizes{};
  shape.dimensions = space ? H5Sget_simple_extent_dims(space.get(), sizes.data(), nullptr) : -1;
  if (shape.dimensions < 1 || shape.dimensions > most_dimensions) {
    return bad("dataset {}: {} dimensions, 1 or 2 expected", dataset, shape.dimensions);
  }
  shape.rows = sizes[0];
  shape.columns = shape.dimensions == 2 ? sizes[1] : 1;
  if (shape.rows > most_rows) {
    return bad("dataset {}: {} rows, at most {} allowed", dataset, shape.rows, most_rows);
  }
  return opened;
}

Expected<void> Reader::transfer(const Handle& opened, const char* dataset, double* to) const {
  if (H5Dread(opened.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) < 0) {
    return bad("dataset {}: {}", dataset, hdf5::last_error());
  }
  return {};
}

Expected<std::vector<double>> Reader::column(const char* dataset) const {
  Shape shape;
  const Expected<Handle> opened = open_dataset(dataset, shape);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  if (shape.dimensions != 1) {
    return bad("dataset {}: shape [{}, {}], [N] expected", dataset, shape.rows, shape.columns);
  }
  std::vector<double> values(shape.rows);
  const Expected<void> read = transfer(*opened, dataset, values.data());
  if (!read) {
    return tl::unexpected(read.error());
  }
  return values;
}

template <std::size_t Columns>
Expected<std::vector<std::array<double, Columns>>> Reader::table(const char* dataset, hsize_t row_limit) const {
  Shape shape;
  const Expected<Handle> opened = open_dataset(dataset, shape);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  if (shape.dimensions != 2 || shape.columns != Columns) {
    const std::string found =
        shape.dimensions == 1 ? fmt::format("[{}]", shape.rows) : fmt::format("[{}, {}]", shape.rows, shape.columns);
    return bad("dataset {}: shape {}, [N, {}] expected", dataset, found, Columns);
  }
  if (shape.rows > row_limit) {
    return bad("dataset {}: {} rows, at most {} allowed", dataset, shape.rows, row_limit);
  }
  std::vector<std::array<double, Columns>> values(shape.rows);
  const Expected<void> read = values.empty() ? Expected<void>{} : transfer(*opened, dataset, values.data()->data());
  if (!read) {
    return tl::unexpected(read.error());
  }
  return values;
}

Expected<void> Reader::read_temperature(Recording& recording) const {
  constexpr const char* dataset = "temperature_c";
  if (!has_dataset(dataset)) {
    return {};
  }
  Shape shape;
  const Expected<Handle> opened = open_dataset(dataset, shape);
  if (!opened) {
    return tl::unexpected(opened.error());
  }
  if (shape.columns < 1 || shape.columns > most_temperature_channels) {
    return bad("dataset {}: {} channels, 1 to {} allowed", dataset, shape.columns, most_temperature_channels);
  }
  if (shape.rows != recording.size()) {
    return bad("{}: {} rows where time_s has {}", dataset, shape.rows, recording.size());
  }
  recording.temperature_channels = shape.columns;
  recording.temperature_c.resize(shape.rows * shape.columns);
  return transfer(*opened, dataset, recording.temperature_c.data());
}

Expected<Recording> Reader::read() {
  Recording recording;
  if (const auto format = check_format(); !format) {
    return tl::unexpected(format.error());
  }
  if (const auto attributes = read_attributes(recording); !attributes) {
    return tl::unexpected(attributes.error());
  }
  const auto keep = [](auto&& from, auto& to) -> Expected<void> {
    if (!from) {
      return tl::unexpected(from.error());
    }
    to = std::move(*from);
    return {};
  };
  Expected<void> read = keep(column("time_s"), recording.time_s);
  if (read) {
    read = keep(table<3>("delta_theta_rad", most_rows), recording.delta_theta_rad);
  }
  if (read) {
    read = keep(table<3>("delta_v_mps", most_rows), recording.delta_v_mps);
  }
  if (read) {
    read = keep(column("gimbal_outer_rad"), recording.gimbal_outer_rad);
  }
  if (read) {
    read = keep(column("gimbal_inner_rad"), recording.gimbal_inner_rad);
  }
  if (read) {
    read = read_temperature(recording);
  }
  if (read && has_dataset("schedule_deg")) {
    read = keep(table<2>("schedule_deg", most_positions), recording.schedule_deg);
  }
  if (!read) {
    return tl::unexpected(read.error());
  }
  return recording;
}

Expected<Recording> parse_open_file(hid_t file, const std::string& name) {
  try {
    return Reader(file, name).read();
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::bad_input, name + ": does not fit into memory");
  }
}

tl::unexpected<Error> not_hdf5(const std::string& name) {
  return fail(ErrorKind::bad_input, fmt::format("{}: cannot read as HDF5: {}", name, hdf5::last_error()));
}

}  // namespace

namespace hdf5 {

Expected<Recording> parse_file(const std::string& path) {
  const QuietErrors quiet;
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  return file ? parse_open_file(file.get(), path) : not_hdf5(path);
}

Expected<Recording> parse_image(const void* image, std::size_t size, const std::string& name) {
  const QuietErrors quiet;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  constexpr std::size_t increment = 65536;
  // The library copies the image; its interface is not const-correct.
  if (H5Pset_fapl_core(access.get(), increment, false) < 0 ||
      H5Pset_file_image(access.get(), const_cast<void*>(image), size) < 0) {
    return not_hdf5(name);
  }
  const Handle file(H5Fopen(name.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  return file ? parse_open_file(file.get(), name) : not_hdf5(name);
}

}  // namespace hdf5
}  // namespace selfcal
