#include "daemon/ins/unlock_key.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <filesystem>

#include "protocol/recording/atomic_file.hpp"

namespace selfcal {
namespace {

std::string key_path(const InsConfig& config) {
  if (!config.key_file.empty()) {
    return config.key_file;
  }
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr) {
    return {};
  }
  for (const std::string& file : {config.name + ".key", std::string("ins.key")}) {
    const auto path = std::filesystem::path(folder) / file;
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored)) {
      return path.string();
    }
  }
  return {};
}

}  // namespace

Expected<UnlockKey> load_unlock_key(const InsConfig& config) {
  const profile::Security& lock = config.profile->security;
  if (!lock.needed || lock.program) {
    return UnlockKey{};
  }
  const std::string path = key_path(config);
  if (path.empty()) {
    return fail(ErrorKind::bad_input,
                fmt::format("ins.{}: no key: set key_file, or give the credential {}.key", config.name, config.name));
  }
  auto text = read_text_file(path, 256);
  if (!text) {
    return tl::unexpected(text.error());
  }
  while (!text->empty() && (text->back() == '\n' || text->back() == '\r' || text->back() == ' ')) {
    text->pop_back();
  }
  UnlockKey key{};
  bool well = text->size() == 2 * key.size();
  for (std::size_t i = 0; well && i < key.size(); ++i) {
    const char* digits = text->data() + 2 * i;
    const auto read = std::from_chars(digits, digits + 2, key[i], 16);
    well = read.ec == std::errc() && read.ptr == digits + 2;
  }
  if (!well) {
    return fail(ErrorKind::bad_input, fmt::format("{}: a key is {} hexadecimal digits", path, 2 * key.size()));
  }
  return key;
}

}  // namespace selfcal
