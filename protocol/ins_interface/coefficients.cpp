#include "protocol/ins_interface/coefficients.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/byte_order.hpp"
#include "protocol/flash/crc32c.hpp"

namespace selfcal::ins {
namespace {

constexpr std::uint32_t magic = 0x5343434F;
constexpr std::uint16_t format_number = 1;
constexpr std::size_t crc_at = 256;

}  // namespace

const std::array<std::string_view, coefficient_count> coefficient_names = {
    "accel_bias_x",          "accel_bias_y",          "accel_bias_z",          "gyro_drift_x",
    "gyro_drift_y",          "gyro_drift_z",          "accel_scale_pos_x",     "accel_scale_pos_y",
    "accel_scale_pos_z",     "accel_scale_neg_x",     "accel_scale_neg_y",     "accel_scale_neg_z",
    "accel_misalignment_yx", "accel_misalignment_zx", "accel_misalignment_zy", "gyro_scale_x",
    "gyro_scale_y",          "gyro_scale_z",          "gyro_misalignment_xy",  "gyro_misalignment_xz",
    "gyro_misalignment_yx",  "gyro_misalignment_yz",  "gyro_misalignment_zx",  "gyro_misalignment_zy"};

CoefficientsBytes encode(const Coefficients& coefficients) {
  CoefficientsBytes bytes{};
  ByteWriter out(bytes);
  out.put(magic);
  out.put(format_number);
  out.put(std::uint16_t{0});
  out.put(coefficients.version);
  out.put(coefficients.date_s);
  out.put_text(coefficients.author, author_bytes);
  for (const double value : coefficients.value) {
    out.put(value);
  }
  const std::span<std::uint8_t> all(bytes);
  ByteWriter(all.subspan(crc_at)).put(flash::crc32c(all.first(crc_at)));
  return bytes;
}

Expected<Coefficients> decode_coefficients(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != coefficients_bytes) {
    return fail(ErrorKind::bad_input,
                fmt::format("coefficient record: {} bytes instead of {}", bytes.size(), coefficients_bytes));
  }
  ByteReader in(bytes);
  if (const auto found = in.get<std::uint32_t>(); found != magic) {
    return fail(ErrorKind::bad_input, fmt::format("coefficient record: magic 0x{:08X}: not such a record", found));
  }
  const std::uint32_t stored = stored_crc(bytes.first<coefficients_bytes>());
  if (const std::uint32_t computed = flash::crc32c(bytes.first(crc_at)); computed != stored) {
    return fail(ErrorKind::bad_input,
                fmt::format("coefficient record: CRC 0x{:08X} is stored, the content has 0x{:08X}", stored, computed));
  }
  if (const auto found = in.get<std::uint16_t>(); found != format_number) {
    return fail(ErrorKind::bad_input, fmt::format("coefficient record: format {} is unknown", found));
  }
  in.get<std::uint16_t>();
  Coefficients result;
  result.version = in.get<std::uint32_t>();
  result.date_s = in.get<std::int64_t>();
  result.author = in.get_text(author_bytes);
  if (!std::ranges::all_of(result.author, [](char c) { return c >= ' ' && c <= '~'; })) {
    return fail(ErrorKind::bad_input, "coefficient record: the author is not printable ASCII");
  }
  for (std::size_t i = 0; i < coefficient_count; ++i) {
    result.value[i] = in.get_double();
    if (!std::isfinite(result.value[i])) {
      return fail(ErrorKind::bad_input, fmt::format("coefficient record: {} is {}, not a finite number",
                                                    coefficient_names[i], result.value[i]));
    }
  }
  return result;
}

std::uint32_t stored_crc(std::span<const std::uint8_t, coefficients_bytes> bytes) {
  return ByteReader(bytes.subspan(crc_at)).get<std::uint32_t>();
}

}  // namespace selfcal::ins
