// Every decoder of bytes that a peer wrote. The first byte of the input chooses; what decodes must encode to the same.
#include <cstdlib>
#include <algorithm>
#include <string_view>

#include "protocol/can/bus_log.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/isotp/codec.hpp"
#include "protocol/uds/decode.hpp"
#include "protocol/uds/messages.hpp"

using namespace selfcal;

namespace {

template <typename Decoded>
void must_encode_to(const Decoded& decoded, std::span<const std::uint8_t> bytes) {
  if (decoded && !std::ranges::equal(ins::encode(*decoded), bytes)) {
    std::abort();
  }
}

void decode_record(std::uint8_t which, std::span<const std::uint8_t> bytes) {
  switch (which % 8) {
    case 0: return must_encode_to(ins::decode_state(bytes), bytes);
    case 1: return must_encode_to(ins::decode_schedule(bytes), bytes);
    case 2: return must_encode_to(ins::decode_site(bytes), bytes);
    case 3: return must_encode_to(ins::decode_directory(bytes), bytes);
    case 4: return must_encode_to(ins::decode_sample_format(bytes), bytes);
    case 5: return must_encode_to(ins::decode_run(bytes), bytes);
    case 6: return must_encode_to(ins::decode_navigation_request(bytes), bytes);
    default: static_cast<void>(ins::decode_coefficients(bytes));
  }
}

void decode_other(std::uint8_t which, std::span<const std::uint8_t> bytes) {
  flash::Page page;
  switch (which % 5) {
    case 0: static_cast<void>(isotp::decode(bytes.first(std::min<std::size_t>(bytes.size(), 64)))); return;
    case 1: static_cast<void>(flash::decode_page(bytes, page)); return;
    case 2: static_cast<void>(uds::describe_message(bytes)); return;
    case 3:
      static_cast<void>(can::parse_log_line({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
      return;
    default:
      static_cast<void>(uds::read_upload_response(bytes));
      static_cast<void>(uds::read_seed_response(bytes));
      static_cast<void>(uds::parse_upload_request(bytes));
      static_cast<void>(uds::parse_routine_request(bytes));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) {
    const std::span<const std::uint8_t> bytes(data + 1, size - 1);
    (data[0] & 0x80U) != 0 ? decode_other(data[0] & 0x7FU, bytes) : decode_record(data[0], bytes);
  }
  return 0;
}
