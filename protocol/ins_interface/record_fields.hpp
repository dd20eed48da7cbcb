// The bytes of every record, field by field, as a table: the handbook's page of the INS interface is made from it, and a
// test reads the encoders' bytes by it. Fields follow each other without gaps, big-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace selfcal::ins {

enum class FieldType : std::uint8_t { u8, u16, u32, u64, i32, i64, f64, text, zero };

struct RecordField {
  std::string_view name;
  FieldType type = FieldType::u8;
  std::size_t count = 1;  // elements; of text and zero, bytes
  std::string_view meaning;
  bool repeated = false;  // as often as the record's first field says
};

struct RecordLayout {
  std::string_view name;  // as in DataIdentifier::content and Routine::content
  std::string_view what;
  std::span<const RecordField> fields;
};
std::span<const RecordLayout> record_layouts();

std::string_view name(FieldType type);        // "u32", "f64", ...
std::size_t bytes(const RecordField& field);  // of all its elements

}  // namespace selfcal::ins
