#include "protocol/import/column_source.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "protocol/import/array_source.hpp"
#include "protocol/import/bag.hpp"
#include "protocol/import/clock_digits.hpp"
#include "protocol/import/novatel.hpp"
#include "protocol/import/split_time.hpp"
#include "protocol/import/summed_intervals.hpp"
#include "protocol/import/text_source.hpp"
#include "protocol/import/word_halves.hpp"
#include "protocol/recording/atomic_file.hpp"
#include "protocol/recording/hdf5.hpp"

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

Expected<std::unique_ptr<ColumnSource>> open_bag(const std::filesystem::path& file,
                                                 Expected<Bag> (*read)(const std::filesystem::path&),
                                                 const std::optional<std::string>& topic) {
  Expected<Bag> bag = read(file);
  if (!bag) {
    return tl::unexpected(bag.error());
  }
  return bag_source(std::move(*bag), file.string(), topic);
}

// What this program does not read, and what helps.
struct Stranger {
  std::string_view magic, words;
};
constexpr std::string_view ardupilot =
    "a log of ArduPilot; `sed -n '/^IMU, [0-9]*, [1-9],/d;s/^FMT.*, IMU, [A-Za-z]*, //p;s/^IMU, //p'` makes columns of "
    "its first sensor's lines";
constexpr std::array<Stranger, 4> strangers{
    {{"FMT, ", ardupilot},
     {"\x89MCAP", "an MCAP file, which this program does not read; `ros2 bag convert` writes it with SQLite storage"},
     {"#ROSRECORD", "a ROS bag of version 1, which this program does not read; version 2.0 is read"},
     {"\x28\xB5\x2F\xFD", "compressed with zstd; `zstd -d` unpacks it"}}};

Expected<std::unique_ptr<ColumnSource>> open_any(const std::filesystem::path& file,
                                                 const std::optional<TextDialect>& dialect,
                                                 const std::optional<std::string>& topic) {
  std::error_code none;
  if (std::filesystem::is_directory(file, none)) {
    return fail(
        ErrorKind::bad_input,
        fmt::format("{}: a folder; of a ROS 2 bag its .db3 file is wanted; files of a row each, as KITTI's oxts/data, "
                    "become one with cat",
                    file.string()));
  }
  const std::string head = first_bytes(file);
  if (head.starts_with("SQLite format 3")) {
    return open_bag(file, read_sqlite_bag, topic);
  }
  if (head.starts_with("#ROSBAG")) {
    return open_bag(file, read_ros1_bag, topic);
  }
  if (topic && !topic->empty()) {
    return fail(ErrorKind::usage, fmt::format("{}: no ROS bag: it has no --topic", file.string()));
  }
  if (head.starts_with("\x93NUMPY")) {
    return open_npy(file);
  }
  if (head.starts_with("PK\x03\x04")) {
    return open_arrays(file, read_npz);
  }
  if (head.starts_with("MATLAB ") || (file.extension() == ".mat" && head.find('\0') != std::string::npos)) {
    return open_arrays(file, read_mat);
  }
  if (head.starts_with("\x89HDF")) {
    if (!is_foreign_hdf5(file)) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: HDF5: a recording, which needs no import, or damaged", file.string()));
    }
    return open_arrays(file, read_hdf5_arrays);
  }
  for (const Stranger& stranger : strangers) {
    if (head.starts_with(stranger.magic)) {
      return fail(ErrorKind::bad_input, fmt::format("{}: {}", file.string(), stranger.words));
    }
  }
  Expected<std::unique_ptr<ColumnSource>> novatel = open_novatel(file);
  return !novatel || *novatel ? std::move(novatel) : open_text(file, dialect);
}

}  // namespace

Expected<std::unique_ptr<ColumnSource>> open_columns(const std::filesystem::path& file,
                                                     const std::optional<TextDialect>& dialect,
                                                     const std::optional<std::string>& topic) {
  try {
    return open_any(file, dialect, topic)
        .map(with_whole_time)
        .map(with_clock_digits)
        .map(with_summed_intervals)
        .map(with_whole_words);
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::bad_input, fmt::format("{}: does not fit into memory", file.string()));
  }
}

}  // namespace selfcal::import
