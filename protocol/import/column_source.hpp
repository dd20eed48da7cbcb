// The columns of a file that somebody else wrote, whatever its form: text, NumPy, MATLAB, ROS.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {

// Which columns to read, counted from 0.
struct ColumnRequest {
  std::vector<std::size_t> columns;
  std::optional<std::size_t> stamp;                       // column of the time; may be among `columns` too
  bool stamp_is_date = false;                             // ISO 8601 instead of a number
  bool tolerant = false;                                  // what is no number reads as NaN; else it is an error
  std::size_t most_rows = std::size_t{24} * 3600 * 2000;  // more is an error; where tolerant, what follows is left out
};

struct ColumnData {
  std::vector<std::vector<double>> values;  // one per requested column, equally long
  // 64 bits of mantissa: nanoseconds since 1970 stay exact. Dates: seconds since 1970.
  std::vector<long double> stamps;
  std::size_t rows = 0;
  bool left_out = false;  // tolerant: the file goes on

  // Of a text: line of row 0, and how far lines run ahead of rows from some row on (comments, blank lines).
  std::size_t first_line = 0;  // 0: no text
  std::vector<std::pair<std::size_t, std::size_t>> skipped;

  // "line 17" of a text, "row 16" otherwise.
  std::string place(std::size_t row) const;
};

class ColumnSource {
 public:
  virtual ~ColumnSource() = default;

  // One per column; empty text where the file gives none.
  virtual const std::vector<std::string>& names() const = 0;
  // One per column, of a text whose second header line holds units and of a bag; else empty.
  virtual const std::vector<std::string>& units() const = 0;
  // "text, commas between the fields, names in line 1"
  virtual std::string form() const = 0;
  // How a text is written; nullptr for other forms.
  virtual const TextDialect* dialect() const { return nullptr; }
  // Words on columns that are read as one; empty: none.
  virtual std::string put_together() const { return {}; }
  // What stands before the numbers of a text, for those who know a format by it.
  virtual std::string preamble() const { return {}; }
  // Errors (bad_input) name file, line or row, column, value, and what was expected.
  virtual Expected<ColumnData> read(const ColumnRequest& request) const = 0;

  // Of a text: the words that stand in a column instead of numbers, where two to eight of them take turns in the first rows: rows of several
  // sensors, one under another. Empty: none.
  virtual std::vector<std::string> labels(std::size_t /*column*/) const { return {}; }
  // Words on the first column with such labels; empty: none.
  std::string mixed_rows() const;

  // "column 3 (gx)"
  std::string title(std::size_t column) const;
};

// Opens FILE by what it holds. A dialect that is given replaces the one that the text shows. A topic is that of the Imu whose
// columns are wanted of a ROS bag: empty for the only one, an error (usage) where there are several; none for all.
Expected<std::unique_ptr<ColumnSource>> open_columns(const std::filesystem::path& file,
                                                     const std::optional<TextDialect>& dialect = std::nullopt,
                                                     const std::optional<std::string>& topic = std::nullopt);

}  // namespace selfcal::import
