#include "protocol/import/column_source.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "protocol/import/array_source.hpp"
#include "protocol/import/text_source.hpp"
#include "protocol/recording/atomic_file.hpp"

namespace selfcal::import {
namespace {

constexpr std::size_t longest_array_file = std::size_t{1} << 35;

std::string first_bytes(const std::filesystem::path& file) {
  std::array<char, 16> bytes{};
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), bytes.size());
  return {bytes.data(), static_cast<std::size_t>(in.gcount())};
}

Expected<std::unique_ptr<ColumnSource>> open_npy(const std::filesystem::path& file) {
  Expected<std::string> image = read_text_file(file, longest_array_file);
  if (!image) {
    return tl::unexpected(image.error());
  }
  Arrays arrays;
  arrays.form = "NumPy .npy";
  if (const auto added = add_npy(std::move(*image), {}, file.string(), arrays); !added) {
    return tl::unexpected(added.error());
  }
  return array_source(std::move(arrays), file.string());
}

Expected<std::unique_ptr<ColumnSource>> open_arrays(const std::filesystem::path& file,
                                                    Expected<Arrays> (*read)(const std::filesystem::path&)) {
  Expected<Arrays> arrays = read(file);
  if (!arrays) {
    return tl::unexpected(arrays.error());
  }
  return array_source(std::move(*arrays), file.string());
}

}  // namespace

Expected<std::unique_ptr<ColumnSource>> open_columns(const std::filesystem::path& file,
                                                     const std::optional<TextDialect>& dialect) {
  try {
    const std::string head = first_bytes(file);
    if (head.starts_with("\x93NUMPY")) {
      return open_npy(file);
    }
    if (head.starts_with("PK\x03\x04")) {
      return open_arrays(file, read_npz);
    }
    if (head.starts_with("MATLAB ") || (file.extension() == ".mat" && head.find('\0') != std::string::npos)) {
      return open_arrays(file, read_mat);
    }
    for (const auto& [magic, kind] : {std::pair{"\x89MCAP", "an MCAP file"}, std::pair{"#ROSBAG", "a ROS bag"}}) {
      if (head.starts_with(magic)) {
        return fail(
            ErrorKind::bad_input,
            fmt::format("{}: {}, which this program does not read; write the topic as CSV", file.string(), kind));
      }
    }
    if (head.starts_with("\x89HDF")) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: an HDF5 file; a recording needs no import, and of others the arrays are wanted as "
                              ".npz, .mat or CSV",
                              file.string()));
    }
    return open_text(file, dialect);
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::bad_input, fmt::format("{}: does not fit into memory", file.string()));
  }
}

}  // namespace selfcal::import
