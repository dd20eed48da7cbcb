#include "daemon/ins/kept_form.hpp"

#include "protocol/flash/page.hpp"
#include "protocol/profile/records.hpp"

namespace selfcal {

Expected<Bytes> page_as_kept(const profile::Profile& profile, std::span<const std::uint8_t> told) {
  if (!profile::checksum_holds(profile.raw.page, told)) {
    return fail(ErrorKind::device, "wrong CRC");
  }
  const auto page = profile::decode_page(profile, told);
  if (!page) {
    return tl::unexpected(page.error());
  }
  flash::PageBytes bytes;
  flash::encode_page(*page, bytes);
  return Bytes(bytes.begin(), bytes.end());
}

Bytes set_as_kept(const ins::Coefficients& set) {
  const auto bytes = ins::encode(set);
  return {bytes.begin(), bytes.end()};
}

}  // namespace selfcal
