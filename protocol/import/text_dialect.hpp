// How a delimited text is written: what stands between fields, in numbers, before comments, and where numbers begin.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/import/dates.hpp"

namespace selfcal::import {

struct TextDialect {
  char separator = ',';         // ' ': any run of blanks and tabs
  char decimal = '.';           // or ','
  std::string comment;          // lines that begin so are passed over; empty: none
  std::size_t header_line = 0;  // of the names, counted from 1; 0: none
  std::size_t unit_line = 0;    // of the units, 0: none
  std::size_t first_line = 1;   // of the numbers
  std::size_t fields = 0;       // of the lines of numbers
  std::size_t other_names = 0;  // of the line above them that has names, but not as many; 0: none
};

// Fields of one line, without blanks and quotes around them. The time that a serial monitor puts before a line ("10:12:00.123 -> ") is the first.
void split_fields(std::string_view line, char separator, std::vector<std::string_view>& fields);

std::string_view trimmed(std::string_view text);

// A finite or infinite number, or none: the whole field is to be one. Sign, decimal comma, exponents with E or D.
std::optional<double> number_of(std::string_view field, char decimal);
// Of a text whose dialect is known: where the decimal mark is a comma, "1.234.567,8" too.
std::optional<double> grouped_number_of(std::string_view field, const TextDialect& dialect);
std::optional<long double> long_number_of(std::string_view field, const TextDialect& dialect);

// What the first lines of a text show. nullopt: no run of lines with the same number of numeric fields, two at least.
// LINES without their ends; a last one that is cut off is not to be among them.
std::optional<TextDialect> detect_dialect(const std::vector<std::string_view>& lines);
// Of lines without a dialect: words on a field of the last one that may be why, with its line and place; empty: none.
std::string unread_field(const std::vector<std::string_view>& lines);

// Names or units in a header line, comment mark and brackets taken off.
std::vector<std::string> header_fields(std::string_view line, const TextDialect& dialect);

}  // namespace selfcal::import
