// .npz and .mat in a program that was built without their libraries.
#include <fmt/format.h>

#include "protocol/import/array_source.hpp"

namespace selfcal::import {
namespace {

Expected<Arrays> missing(const std::filesystem::path& file) {
  return fail(ErrorKind::usage, fmt::format("{}: this program was built without .npz and .mat; `tools/setup programs` "
                                            "builds them; .npy and text are read",
                                            file.string()));
}

}  // namespace

Expected<Arrays> read_npz(const std::filesystem::path& file) { return missing(file); }
Expected<Arrays> read_mat(const std::filesystem::path& file) { return missing(file); }

}  // namespace selfcal::import
