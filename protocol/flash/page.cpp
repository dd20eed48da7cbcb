#include "protocol/flash/page.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "protocol/byte_order.hpp"
#include "protocol/flash/crc32c.hpp"

namespace selfcal::flash {
namespace {

constexpr std::size_t crc_at = 32;
constexpr double temperature_lsb = 0.01;  // degC

// The field of the CRC counts as zero.
std::uint32_t page_crc(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 4> zeros{};
  return crc32c(bytes.subspan(crc_at + 4), crc32c(zeros, crc32c(bytes.first(crc_at))));
}

std::int16_t temperature_counts(double celsius) {
  return static_cast<std::int16_t>(std::lround(std::clamp(celsius / temperature_lsb, -32768.0, 32767.0)));
}

void put_sample(const SampleCounts& sample, ByteWriter& out) {
  for (const std::int32_t count : sample.delta_theta) {
    out.put(count);
  }
  for (const std::int32_t count : sample.delta_v) {
    out.put(count);
  }
  out.put(sample.outer);
  out.put(sample.inner);
}

SampleCounts get_sample(ByteReader& in) {
  SampleCounts sample;
  for (std::int32_t& count : sample.delta_theta) {
    count = in.get<std::int32_t>();
  }
  for (std::int32_t& count : sample.delta_v) {
    count = in.get<std::int32_t>();
  }
  sample.outer = in.get<std::uint16_t>();
  sample.inner = in.get<std::uint16_t>();
  return sample;
}

}  // namespace

std::string_view name(PageError error) {
  switch (error) {
    case PageError::wrong_size: return "not 4096 bytes";
    case PageError::bad_crc: return "CRC does not agree";
    case PageError::bad_magic: return "not a raw-data page";
    case PageError::unknown_format: return "unknown page format";
    case PageError::bad_count: return "more samples than fit";
  }
  return "unknown";
}

void encode_page(const Page& page, std::span<std::uint8_t, page_bytes> out) {
  assert(page.samples.size() <= samples_per_page);
  std::ranges::fill(out, std::uint8_t{0xFF});  // as erased FLASH reads
  ByteWriter bytes(out);
  bytes.put(page_magic);
  bytes.put(page_format);
  bytes.put(static_cast<std::uint16_t>(page.samples.size()));
  bytes.put(page.run_id);
  bytes.put(page.sequence);
  bytes.put(page.first_sample);
  bytes.put(temperature_counts(page.temperature_c));
  bytes.put(page.flags);
  bytes.put(std::uint32_t{0});
  bytes.put(std::uint32_t{0});
  for (const SampleCounts& sample : page.samples) {
    put_sample(sample, bytes);
  }
  ByteWriter(out.subspan(crc_at)).put(page_crc(out));
}

tl::expected<void, PageError> decode_page(std::span<const std::uint8_t> bytes, Page& page) {
  if (bytes.size() != page_bytes) {
    return tl::unexpected(PageError::wrong_size);
  }
  ByteReader in(bytes);
  if (in.get<std::uint32_t>() != page_magic) {
    return tl::unexpected(PageError::bad_magic);
  }
  if (ByteReader(bytes.subspan(crc_at)).get<std::uint32_t>() != page_crc(bytes)) {
    return tl::unexpected(PageError::bad_crc);
  }
  if (in.get<std::uint16_t>() != page_format) {
    return tl::unexpected(PageError::unknown_format);
  }
  const auto count = in.get<std::uint16_t>();
  if (count > samples_per_page) {
    return tl::unexpected(PageError::bad_count);
  }
  page.run_id = in.get<std::uint32_t>();
  page.sequence = in.get<std::uint32_t>();
  page.first_sample = in.get<std::uint64_t>();
  page.temperature_c = in.get<std::int16_t>() * temperature_lsb;
  page.flags = in.get<std::uint16_t>();
  ByteReader samples(bytes.subspan(page_header_bytes));
  page.samples.resize(count);
  for (SampleCounts& sample : page.samples) {
    sample = get_sample(samples);
  }
  return {};
}

}  // namespace selfcal::flash
