#include <filesystem>

#include "protocol/recording/hdf5.hpp"
#include "protocol/recording/hdf5_handle.hpp"
#include "protocol/recording/hdf5_parse.hpp"
#include "protocol/recording/isolated_parse.hpp"

namespace selfcal {
namespace {

Expected<LoadedRecording> checked(Expected<Recording> recording, const std::string& name, const CheckPolicy& policy) {
  if (!recording) {
    return tl::unexpected(recording.error());
  }
  auto warnings = check_recording(*recording, policy);
  if (!warnings) {
    return fail(warnings.error().kind, name + ": " + warnings.error().message);
  }
  return LoadedRecording{std::move(*recording), std::move(*warnings)};
}

}  // namespace

Expected<LoadedRecording> read_hdf5(const std::filesystem::path& path, const CheckPolicy& policy) {
  const std::string name = path.string();
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (!std::filesystem::exists(status)) {
    return fail(ErrorKind::bad_input, name + ": no such file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    return fail(ErrorKind::bad_input, name + ": not a regular file");
  }
  return checked(parse_isolated(name, [&] { return hdf5::parse_file(name); }), name, policy);
}

bool is_foreign_hdf5(const std::filesystem::path& path) {
  const auto answer = bytes_isolated(path.string(), [&path]() -> Expected<std::string> {
    const hdf5::QuietErrors quiet;
    const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    return std::string(file && H5Aexists(file.get(), "format") == 0 ? "foreign" : "");
  });
  return answer && !answer->empty();
}

Expected<LoadedRecording> read_hdf5_image(const void* image, std::size_t size, const std::string& name,
                                          const CheckPolicy& policy) {
  return checked(parse_isolated(name, [&] { return hdf5::parse_image(image, size, name); }), name, policy);
}

}  // namespace selfcal
