#include "protocol/profile/layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "protocol/flash/crc32c.hpp"

namespace selfcal::profile {
namespace {

constexpr std::array types{FieldType{"u8", Kind::unsigned_integer, 1},
                           FieldType{"u16", Kind::unsigned_integer, 2},
                           FieldType{"u24", Kind::unsigned_integer, 3},
                           FieldType{"u32", Kind::unsigned_integer, 4},
                           FieldType{"u64", Kind::unsigned_integer, 8},
                           FieldType{"i8", Kind::signed_integer, 1},
                           FieldType{"i16", Kind::signed_integer, 2},
                           FieldType{"i24", Kind::signed_integer, 3},
                           FieldType{"i32", Kind::signed_integer, 4},
                           FieldType{"i64", Kind::signed_integer, 8},
                           FieldType{"f32", Kind::floating, 4},
                           FieldType{"f64", Kind::floating, 8},
                           FieldType{"ascii", Kind::text, 0}};
constexpr std::array<std::string_view, 3> algorithms{"crc32c", "crc32", "crc16"};

std::uint64_t raw_bits(const Field& field, ByteView bytes) {
  std::uint64_t raw = 0;
  for (std::size_t i = 0; i < field.type.bytes; ++i) {
    raw = raw << 8U | bytes[field.order == ByteOrder::big ? i : field.type.bytes - 1 - i];
  }
  return raw;
}

void put_bits(const Field& field, std::uint64_t raw, std::span<std::uint8_t> bytes) {
  for (std::size_t i = 0; i < field.type.bytes; ++i) {
    const std::size_t at = field.order == ByteOrder::big ? field.type.bytes - 1 - i : i;
    bytes[at] = static_cast<std::uint8_t>(raw >> (8 * i));
  }
}

std::uint64_t mask_of(unsigned bits) { return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1; }

unsigned width(const Field& field) { return field.bits > 0 ? field.bits : static_cast<unsigned>(8 * field.type.bytes); }

long double raw_number(const Field& field, std::uint64_t raw) {
  switch (field.type.kind) {
    case Kind::signed_integer: {
      const unsigned shift = 64 - static_cast<unsigned>(8 * field.type.bytes);
      return static_cast<long double>(static_cast<std::int64_t>(raw << shift) >> shift);
    }
    case Kind::floating:
      return field.type.bytes == 4 ? static_cast<long double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)))
                                   : static_cast<long double>(std::bit_cast<double>(raw));
    default: return static_cast<long double>(raw >> field.first_bit & mask_of(width(field)));
  }
}

tl::unexpected<Error> wrong(const Layout& layout, const std::string& what) {
  return fail(ErrorKind::bad_input, fmt::format("{} record: {}", layout.record, what));
}

// A signed 64-bit value in the bits of its field, or none where it does not fit.
std::optional<std::uint64_t> integer_bits(const Field& field, long double value) {
  const long double rounded = std::round(value);
  const unsigned bits = width(field);
  const bool is_signed = field.type.kind == Kind::signed_integer;
  const long double span = std::ldexp(1.0L, static_cast<int>(bits - (is_signed ? 1 : 0)));
  if (!(rounded < span && rounded >= (is_signed ? -span : 0.0L))) {  // written so that NaN fails too
    return std::nullopt;
  }
  const std::uint64_t raw =
      is_signed ? static_cast<std::uint64_t>(static_cast<std::int64_t>(rounded)) : static_cast<std::uint64_t>(rounded);
  return raw & mask_of(bits);
}

std::string number_text(long double value) { return fmt::format("{:.10g}", static_cast<double>(value)); }

Expected<void> put_number(const Layout& layout, const Field& field, long double value, std::span<std::uint8_t> bytes) {
  if (!field.codes.empty()) {
    const auto code = field.codes.find(static_cast<std::uint64_t>(value));
    if (code == field.codes.end()) {
      return wrong(layout, fmt::format("{} is {}, for which the profile has no code", field.name, number_text(value)));
    }
    value = static_cast<long double>(code->second);
  } else if (!field.constant) {
    value = (value - field.offset) / field.scale;
  }
  if (field.type.kind == Kind::floating) {
    const auto as_double = static_cast<double>(value);
    if (field.type.bytes == 8) {
      put_bits(field, std::bit_cast<std::uint64_t>(as_double), bytes);
      return {};
    }
    if (std::isfinite(as_double) && std::abs(as_double) > std::numeric_limits<float>::max()) {
      return wrong(layout, fmt::format("{} is {}, which f32 does not hold", field.name, number_text(value)));
    }
    put_bits(field, std::bit_cast<std::uint32_t>(static_cast<float>(as_double)), bytes);
    return {};
  }
  const auto raw = integer_bits(field, value);
  if (!raw) {
    return wrong(layout, fmt::format("{} is {}, which does not fit {} bits of {}", field.name,
                                     number_text(value * field.scale + field.offset), width(field), field.type.name));
  }
  const std::uint64_t others = field.bits > 0 ? raw_bits(field, bytes) & ~(mask_of(field.bits) << field.first_bit) : 0;
  put_bits(field, others | *raw << field.first_bit, bytes);
  return {};
}

Expected<long double> get_number(const Layout& layout, const Field& field, ByteView bytes) {
  const long double raw = raw_number(field, raw_bits(field, bytes));
  if (field.constant) {
    if (raw != *field.constant) {
      return wrong(layout,
                   fmt::format("{} is {}, {} expected", field.name, number_text(raw), number_text(*field.constant)));
    }
    return raw;
  }
  if (!field.codes.empty()) {
    for (const auto& [ours, theirs] : field.codes) {
      if (static_cast<long double>(theirs) == raw) {
        return static_cast<long double>(ours);
      }
    }
    return wrong(layout, fmt::format("{} is {} ({})", field.name, number_text(raw), field.meaning));
  }
  return raw * field.scale + field.offset;
}

Expected<void> get_text(const Layout& layout, const Field& field, ByteView bytes, Values& values) {
  std::string text;
  for (const std::uint8_t byte : bytes.first(field.type.bytes)) {
    if (byte == 0) {
      break;
    }
    if (byte < 0x20 || byte > 0x7E) {
      return wrong(layout, fmt::format("{} is not printable ASCII", field.name));
    }
    text += static_cast<char>(byte);
  }
  values.texts[field.name] = std::move(text);
  return {};
}

Expected<void> get_field(const Layout& layout, const Field& field, ByteView bytes, Values& values) {
  if (field.type.kind == Kind::text) {
    return get_text(layout, field, bytes.subspan(field.at), values);
  }
  std::vector<long double>& into = values.numbers[field.name];
  for (std::size_t k = 0; k < field.count; ++k) {
    const auto number = get_number(layout, field, bytes.subspan(field.at + k * field.type.bytes));
    if (!number) {
      return tl::unexpected(number.error());
    }
    into.push_back(*number);
  }
  return {};
}

Expected<void> put_field(const Layout& layout, const Field& field, const Values& values, std::size_t first,
                         std::span<std::uint8_t> bytes) {
  const auto part = bytes.subspan(field.at);
  if (field.type.kind == Kind::text) {
    const std::string text = values.text(field.name);
    for (std::size_t i = 0; i < field.type.bytes; ++i) {
      part[i] = i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0};
    }
    return {};
  }
  const auto found = values.numbers.find(field.name);
  for (std::size_t k = 0; k < field.count; ++k) {
    const bool there = found != values.numbers.end() && first + k < found->second.size();
    if (!there && !field.constant) {
      return wrong(layout, fmt::format("{} has no value", field.name));
    }
    const long double value = field.constant ? *field.constant : found->second[first + k];
    if (auto put = put_number(layout, field, value, part.subspan(k * field.type.bytes)); !put) {
      return put;
    }
  }
  return {};
}

std::uint64_t crc_reflected(ByteView bytes, std::uint32_t polynomial, std::uint32_t crc) {
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1U) != 0 ? crc >> 1U ^ polynomial : crc >> 1U;
    }
  }
  return crc ^ 0xFFFFFFFFU;
}

std::uint64_t crc16(ByteView bytes) {  // CRC-16/IBM-3740, also called CCITT-FALSE
  std::uint32_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 0x8000U) != 0 ? crc << 1U ^ 0x1021U : crc << 1U;
    }
  }
  return crc & 0xFFFFU;
}

Expected<void> check_length(const Layout& layout, std::size_t bytes, std::size_t wanted) {
  if (bytes != wanted) {
    return wrong(layout, fmt::format("{} bytes instead of {}", bytes, wanted));
  }
  return {};
}

Expected<std::size_t> repetitions(const Layout& layout, const Values& values) {
  const auto count = static_cast<std::size_t>(std::max(0.0L, values.number(layout.each->count)));
  if (count > layout.most_repetitions()) {
    return wrong(layout, fmt::format("{} is {}, {} fit", layout.each->count, count, layout.most_repetitions()));
  }
  return count;
}

}  // namespace

std::span<const FieldType> field_types() { return types; }
std::span<const std::string_view> checksum_algorithms() { return algorithms; }
std::size_t checksum_bytes(std::string_view algorithm) { return algorithm == "crc16" ? 2 : 4; }

const Field* Layout::find(std::string_view name) const {
  for (const auto* list : {&fields, each ? &each->fields : &fields}) {
    const auto found = std::ranges::find(*list, name, &Field::name);
    if (found != list->end()) {
      return &*found;
    }
  }
  return nullptr;
}

std::size_t Layout::fixed_bytes() const { return each && bytes == 0 ? each->at : bytes; }

long double Values::number(std::string_view name, long double otherwise) const {
  const auto found = numbers.find(name);
  return found == numbers.end() || found->second.empty() ? otherwise : found->second.front();
}

std::string Values::text(std::string_view name) const {
  const auto found = texts.find(name);
  return found == texts.end() ? std::string() : found->second;
}

namespace {

bool long_enough(const Checksum& sum, ByteView bytes) { return bytes.size() >= std::max(sum.field.end(), sum.to); }

}  // namespace

std::uint64_t stored_checksum(const Layout& layout, ByteView bytes) {
  if (!long_enough(*layout.checksum, bytes)) {
    return std::numeric_limits<std::uint64_t>::max();  // no checksum of up to 32 bits
  }
  return raw_bits(layout.checksum->field, bytes.subspan(layout.checksum->field.at));
}

std::uint64_t computed_checksum(const Layout& layout, ByteView bytes) {
  const Checksum& sum = *layout.checksum;
  if (!long_enough(sum, bytes)) {
    return 0;
  }
  Bytes covered(bytes.begin() + static_cast<std::ptrdiff_t>(sum.from),
                bytes.begin() + static_cast<std::ptrdiff_t>(sum.to));
  for (std::size_t at = std::max(sum.from, sum.field.at); at < std::min(sum.to, sum.field.end()); ++at) {
    covered[at - sum.from] = 0;
  }
  if (sum.algorithm == "crc32c") {
    return flash::crc32c(covered);
  }
  return sum.algorithm == "crc16" ? crc16(covered) : crc_reflected(covered, 0xEDB88320U, 0xFFFFFFFFU);
}

bool checksum_holds(const Layout& layout, ByteView bytes) {
  return !layout.checksum || stored_checksum(layout, bytes) == computed_checksum(layout, bytes);
}

bool length_fits(const Layout& layout, ByteView bytes) {
  if (!layout.each || layout.bytes > 0) {
    return bytes.size() == layout.bytes;
  }
  const Field* count = layout.find(layout.each->count);
  if (bytes.size() < layout.each->at || count == nullptr) {
    return false;
  }
  const auto number = get_number(layout, *count, bytes.subspan(count->at));
  return number && *number >= 0 &&
         static_cast<long double>(bytes.size() - layout.each->at) ==
             *number * static_cast<long double>(layout.each->stride);
}

Expected<Values> read_fields(const Layout& layout, ByteView bytes) {
  const bool open = layout.each && layout.bytes == 0;
  if (open ? bytes.size() < layout.fixed_bytes() : bytes.size() != layout.bytes) {
    return wrong(layout, fmt::format("{} bytes instead of {}", bytes.size(), layout.fixed_bytes()));
  }
  if (layout.checksum) {
    const std::uint64_t stored = stored_checksum(layout, bytes);
    const std::uint64_t computed = computed_checksum(layout, bytes);
    if (stored != computed) {
      return wrong(layout, fmt::format("CRC 0x{:08X} is stored, the content has 0x{:08X}", stored, computed));
    }
  }
  Values values;
  for (const Field& field : layout.fields) {
    if (auto got = get_field(layout, field, bytes, values); !got) {
      return tl::unexpected(got.error());
    }
  }
  if (!layout.each) {
    return values;
  }
  const auto count = repetitions(layout, values);
  if (!count) {
    return tl::unexpected(count.error());
  }
  if (open) {
    if (auto length = check_length(layout, bytes.size(), layout.each->at + *count * layout.each->stride); !length) {
      return tl::unexpected(length.error());
    }
  }
  for (std::size_t k = 0; k < *count; ++k) {
    for (const Field& field : layout.each->fields) {
      if (auto got = get_field(layout, field, bytes.subspan(layout.each->at + k * layout.each->stride), values); !got) {
        return tl::unexpected(got.error());
      }
    }
  }
  return values;
}

Expected<Bytes> write_fields(const Layout& layout, const Values& values) {
  std::size_t count = 0;
  if (layout.each) {
    const auto wanted = repetitions(layout, values);
    if (!wanted) {
      return tl::unexpected(wanted.error());
    }
    count = *wanted;
  }
  const bool open = layout.each && layout.bytes == 0;
  Bytes bytes(open ? layout.each->at + count * layout.each->stride : layout.bytes, layout.fill);
  for (const Field& field : layout.fields) {
    if (auto put = put_field(layout, field, values, 0, bytes); !put) {
      return tl::unexpected(put.error());
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    const auto part = std::span(bytes).subspan(layout.each->at + k * layout.each->stride);
    for (const Field& field : layout.each->fields) {
      if (auto put = put_field(layout, field, values, k * field.count, part); !put) {
        return tl::unexpected(put.error());
      }
    }
  }
  if (layout.checksum) {
    put_bits(layout.checksum->field, computed_checksum(layout, bytes),
             std::span(bytes).subspan(layout.checksum->field.at));
  }
  return bytes;
}

}  // namespace selfcal::profile
