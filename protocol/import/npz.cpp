// NumPy's .npz: a zip archive of .npy files, read with libzip.
#include <fmt/format.h>
#include <zip.h>

#include <memory>

#include "protocol/import/array_source.hpp"

namespace selfcal::import {
namespace {

constexpr zip_uint64_t most_bytes = zip_uint64_t{1} << 35;

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct Close {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};

Expected<std::string> contents(zip_t* archive, zip_uint64_t index, zip_uint64_t size, const std::string& where) {
  const std::unique_ptr<zip_file_t, Close> entry(zip_fopen_index(archive, index, 0));
  if (!entry) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", where, zip_strerror(archive)));
  }
  // In pieces: a size that is announced and not there costs no memory.
  std::string bytes;
  constexpr std::size_t block = std::size_t{1} << 20;
  while (bytes.size() < size) {
    const std::size_t held = bytes.size();
    bytes.resize(held + block);
    const zip_int64_t count = zip_fread(entry.get(), bytes.data() + held, block);
    if (count <= 0) {
      return fail(ErrorKind::bad_input, fmt::format("{}: damaged: {} bytes of {}", where, held, size));
    }
    bytes.resize(held + static_cast<std::size_t>(count));
  }
  return bytes;
}

}  // namespace

Expected<Arrays> read_npz(const std::filesystem::path& file) {
  int code = 0;
  const std::unique_ptr<zip_t, Discard> archive(zip_open(file.c_str(), ZIP_RDONLY, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    std::string words = zip_error_strerror(&error);
    zip_error_fini(&error);
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot read as .npz: {}", file.string(), words));
  }
  Arrays arrays;
  arrays.form = "NumPy .npz";
  zip_uint64_t bytes = 0;
  for (zip_int64_t index = 0; index < zip_get_num_entries(archive.get(), 0); ++index) {
    zip_stat_t status;
    const auto at = static_cast<zip_uint64_t>(index);
    constexpr std::string_view ending = ".npy";
    if (zip_stat_index(archive.get(), at, 0, &status) != 0 || (status.valid & ZIP_STAT_SIZE) == 0) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: entry {}: {}", file.string(), index, zip_strerror(archive.get())));
    }
    std::string name = (status.valid & ZIP_STAT_NAME) != 0 ? status.name : "";
    if (!name.ends_with(ending)) {
      continue;
    }
    bytes += status.size;
    if (status.size > most_bytes || bytes > most_bytes) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: {}: {} bytes, at most {} are allowed", file.string(), name, bytes, most_bytes));
    }
    Expected<std::string> image = contents(archive.get(), at, status.size, fmt::format("{}: {}", file.string(), name));
    if (!image) {
      return tl::unexpected(image.error());
    }
    name.resize(name.size() - ending.size());
    if (const auto added = add_npy(std::move(*image), name, file.string(), arrays); !added) {
      return tl::unexpected(added.error());
    }
  }
  if (arrays.columns.empty() && zip_get_num_entries(archive.get(), 0) > 0) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: a zip of other files than NumPy's: unpack it and give what it holds; `selfcal poses "
                            "--gyros` takes a file of each sensor",
                            file.string()));
  }
  return arrays;
}

}  // namespace selfcal::import
