#include "protocol/uds/security.hpp"

#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>

#include <memory>

namespace selfcal::uds {

Expected<std::array<std::uint8_t, 16>> answer_seed(const SecurityKey& key, std::span<const std::uint8_t> seed) {
  const std::unique_ptr<EVP_MAC, void (*)(EVP_MAC*)> mac(EVP_MAC_fetch(nullptr, "CMAC", nullptr), &EVP_MAC_free);
  const std::unique_ptr<EVP_MAC_CTX, void (*)(EVP_MAC_CTX*)> context(mac ? EVP_MAC_CTX_new(mac.get()) : nullptr,
                                                                     &EVP_MAC_CTX_free);
  char cipher[] = "AES-128-CBC";
  const OSSL_PARAM parameters[] = {OSSL_PARAM_construct_utf8_string(OSSL_MAC_PARAM_CIPHER, cipher, 0),
                                   OSSL_PARAM_construct_end()};
  std::array<std::uint8_t, 16> answer{};
  std::size_t length = 0;
  if (!context || EVP_MAC_init(context.get(), key.data(), key.size(), parameters) != 1 ||
      EVP_MAC_update(context.get(), seed.data(), seed.size()) != 1 ||
      EVP_MAC_final(context.get(), answer.data(), &length, answer.size()) != 1 || length != answer.size()) {
    return fail(ErrorKind::internal, "OpenSSL cannot compute AES-CMAC");
  }
  return answer;
}

bool equal_in_constant_time(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace selfcal::uds
