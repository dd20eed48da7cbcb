// Where the fields of a record stand and what their bits mean: the codec that a profile describes.
//
// A number is carried as long double, which on every machine that this runs on holds all of u64, i64 and double exactly, so
// that a field without scale and unit gives back its very bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::profile {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

enum class ByteOrder : std::uint8_t { big, little };

enum class Kind : std::uint8_t { unsigned_integer, signed_integer, floating, text };
struct FieldType {
  std::string_view name;  // "u8" to "f64", "ascii"
  Kind kind = Kind::unsigned_integer;
  std::size_t bytes = 1;  // of one element; of text, the profile says
};
std::span<const FieldType> field_types();

struct Field {
  std::string name;
  std::string_view meaning;  // for messages; of the role's table
  std::size_t line = 0;      // of the profile
  std::size_t at = 0;        // bytes from the beginning of the record, or of the repetition
  FieldType type;            // with the length in bytes
  std::size_t count = 1;     // elements, one behind the other
  ByteOrder order = ByteOrder::big;
  unsigned first_bit = 0, bits = 0;  // part of an unsigned integer, bit 0 the lowest; bits 0: all of it
  // Value in the role's unit = raw * scale + offset.
  double scale = 1.0, offset = 0.0;
  double nominal = 0.0;  // the field tells this times (1 + value), as scale and offset say; 0: none
  std::string unit;      // as the profile writes it
  std::map<std::uint64_t, std::uint64_t> codes;  // the role's number to the INS's; empty: they are the same
  std::optional<long double> constant;           // always this
  std::optional<std::uint16_t> did;              // of a set that is told field by field: the field's own identifier
  std::optional<std::uint32_t> memory;           // or its address
  std::size_t end() const { return at + type.bytes * count; }
};

struct Checksum {
  std::size_t line = 0;
  std::string algorithm;  // crc32c, crc32, crc16
  Field field;
  std::size_t from = 0, to = 0;  // bytes that it covers; its own count as zero
};
std::span<const std::string_view> checksum_algorithms();
std::size_t checksum_bytes(std::string_view algorithm);

struct Layout {
  std::string record;     // what messages call it
  std::size_t bytes = 0;  // of the whole record; 0 with repetitions: as many as there are
  std::vector<Field> fields;
  struct Repetition {
    std::size_t at = 0, stride = 0;
    std::size_t most = 0;  // that there can be
    std::string count;     // the field that says how many
    std::vector<Field> fields;
  };
  std::optional<Repetition> each;
  std::optional<Checksum> checksum;
  std::uint8_t fill = 0;  // bytes that no field has

  const Field* find(std::string_view name) const;  // also among the repeated ones
  std::size_t fixed_bytes() const;                 // without repetitions
  std::size_t most_repetitions() const { return each ? each->most : 0; }
};

// Elements of a field, and of a repeated one its elements in every repetition.
struct Values {
  std::map<std::string, std::vector<long double>, std::less<>> numbers;
  std::map<std::string, std::string, std::less<>> texts;

  bool has(std::string_view name) const { return numbers.contains(name); }
  // Of a field that may be absent.
  long double number(std::string_view name, long double otherwise = 0.0L) const;
  std::string text(std::string_view name) const;
};

// Fails (bad_input) on the length, a constant that differs, a checksum, a code that the profile does not name and text that is
// not printable; the message names record and field.
[[nodiscard]] Expected<Values> read_fields(const Layout& layout, ByteView bytes);
// Fails where a value is missing or does not fit its field.
[[nodiscard]] Expected<Bytes> write_fields(const Layout& layout, const Values& values);

// Whether bytes have the length that the layout, and their count of repetitions, ask for.
bool length_fits(const Layout& layout, ByteView bytes);

// The checksum of a record that holds it: stored and computed. Never equal where the record is too short for either.
std::uint64_t stored_checksum(const Layout& layout, ByteView bytes);
std::uint64_t computed_checksum(const Layout& layout, ByteView bytes);
// They are equal, or the record has none.
bool checksum_holds(const Layout& layout, ByteView bytes);

}  // namespace selfcal::profile
