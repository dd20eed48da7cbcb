#include "protocol/recording/file_hash.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cassert>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace selfcal {
namespace {

constexpr std::size_t piece_bytes = 65536;

tl::unexpected<Error> unreadable(const std::filesystem::path& path) {
  return fail(ErrorKind::bad_input, fmt::format("{}: cannot read: {}", path.string(), std::strerror(errno)));
}

using Digest = std::array<unsigned char, EVP_MAX_MD_SIZE>;

std::string hexadecimal(const Digest& digest, unsigned int length) {
  std::string text;
  for (unsigned int k = 0; k < length; ++k) {
    text += fmt::format("{:02x}", digest[k]);
  }
  return text;
}

}  // namespace

Expected<std::string> sha256_of_file(const std::filesystem::path& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rbe"), &std::fclose);
  if (!file) {
    return unreadable(path);
  }
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  bool good = context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1;
  std::array<unsigned char, piece_bytes> piece;
  while (good) {
    const std::size_t count = std::fread(piece.data(), 1, piece.size(), file.get());
    if (count == 0) {
      break;
    }
    good = EVP_DigestUpdate(context.get(), piece.data(), count) == 1;
  }
  if (std::ferror(file.get()) != 0) {
    return unreadable(path);
  }
  Digest digest{};
  unsigned int length = 0;
  if (!good || EVP_DigestFinal_ex(context.get(), digest.data(), &length) != 1) {
    return fail(ErrorKind::internal, "OpenSSL cannot compute SHA-256");
  }
  return hexadecimal(digest, length);
}

std::string sha256_of_text(std::string_view text) {
  Digest digest{};
  unsigned int length = 0;
  const int good = EVP_Digest(text.data(), text.size(), digest.data(), &length, EVP_sha256(), nullptr);
  assert(good == 1);
  static_cast<void>(good);
  return hexadecimal(digest, length);
}

}  // namespace selfcal
