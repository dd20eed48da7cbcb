// A raw-data page as it stands in FLASH and crosses the bus: 36 bytes of header, then up to 145 samples of 28 bytes.
//
//   0  u32 magic "SCRP"      8  u32 run id             16  u64 index of the first sample     28  u32 reserved, 0
//   4  u16 format, 1        12  u32 sequence, from 0   24  i16 temperature, 0.01 degC        32  u32 CRC-32C of all 4096
//   6  u16 sample count                                26  u16 flags                             bytes, this field as 0
// Sample: 3 x i32 delta theta, 3 x i32 delta v, u16 outer, u16 inner, in counts; sample i of the run ends at
// (i+1)/rate. What a count is worth the sample format says, as exact doubles. Unused room is 0xFF. Big-endian.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace selfcal::flash {

inline constexpr std::size_t page_bytes = 4096;
inline constexpr std::size_t page_header_bytes = 36;
inline constexpr std::size_t sample_bytes = 28;
inline constexpr std::size_t samples_per_page = (page_bytes - page_header_bytes) / sample_bytes;  // 145
inline constexpr std::uint32_t page_magic = 0x53435250;
inline constexpr std::uint16_t page_format = 1;
inline constexpr double counts_per_turn = 65536.0;  // gimbal read-outs

namespace page_flag {
inline constexpr std::uint16_t last_of_run = 1;
inline constexpr std::uint16_t sensor_saturated = 2;
}  // namespace page_flag

struct SampleCounts {
  std::array<std::int32_t, 3> delta_theta{};
  std::array<std::int32_t, 3> delta_v{};
  std::uint16_t outer = 0;  // of counts_per_turn
  std::uint16_t inner = 0;

  bool operator==(const SampleCounts&) const = default;
};

struct Page {
  std::uint32_t run_id = 0;
  std::uint32_t sequence = 0;  // page of the run, from 0
  std::uint64_t first_sample = 0;
  double temperature_c = 0.0;  // rounded to 0.01
  std::uint16_t flags = 0;
  std::vector<SampleCounts> samples;  // at most samples_per_page
};

using PageBytes = std::array<std::uint8_t, page_bytes>;

void encode_page(const Page& page, std::span<std::uint8_t, page_bytes> out);

enum class PageError : std::uint8_t { wrong_size, bad_crc, bad_magic, unknown_format, bad_count };
std::string_view name(PageError error);

// Into a page that is kept: its samples' storage is reused.
tl::expected<void, PageError> decode_page(std::span<const std::uint8_t> bytes, Page& page);

}  // namespace selfcal::flash
