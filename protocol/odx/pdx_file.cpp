// A PDX: a zip of ODX files with their catalogue.
#include <fmt/format.h>
#include <zip.h>

#include <memory>

#include "protocol/odx/odx.hpp"

namespace selfcal::odx {
namespace {

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
using Archive = std::unique_ptr<zip_t, Discard>;

}  // namespace

Expected<void> write_pdx(const Export& made, const std::string& path) {
  const auto trouble = [&](const std::string& why) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be written: {}", path, why));
  };
  int code = 0;
  Archive archive(zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
  if (!archive) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    std::string why = zip_error_strerror(&error);
    zip_error_fini(&error);
    return trouble(why);
  }
  for (const auto& [name, text] : made.files) {
    zip_source_t* source = zip_source_buffer(archive.get(), text.data(), text.size(), 0);
    if (source == nullptr || zip_file_add(archive.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8) < 0) {
      zip_source_free(source);
      return trouble(zip_strerror(archive.get()));
    }
  }
  if (zip_close(archive.get()) != 0) {
    return trouble(zip_strerror(archive.get()));
  }
  static_cast<void>(archive.release());  // closed
  return {};
}

}  // namespace selfcal::odx
