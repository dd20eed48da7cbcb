#include "protocol/import/text_source.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "protocol/import/guess_names.hpp"
#include "protocol/import/labelled_lines.hpp"
#include "protocol/import/line_reader.hpp"
#include "protocol/import/repeated_lines.hpp"
#include "protocol/import/rows_in_turns.hpp"
#include "protocol/toml_file/utf8.hpp"

namespace selfcal::import {
namespace {

constexpr std::size_t lines_to_judge = 2000;

// For a message of one line: no control characters, no broken UTF-8, not too long.
std::string shown(std::string_view field) {
  constexpr std::size_t longest = 40;
  std::string text;
  for (const char c : field.substr(0, longest)) {
    const auto byte = static_cast<unsigned char>(c);
    text += byte < 0x20 || byte >= 0x7F ? '?' : c;
  }
  return fmt::format("\"{}\"{}", text, field.size() > longest ? "..." : "");
}

// Names of old spreadsheets are Latin-1 (a degree sign); what is written of them is UTF-8.
std::vector<std::string> as_utf8(std::vector<std::string> names) {
  for (std::string& name : names) {
    std::replace_if(
        name.begin(), name.end(), [](char c) { return (c >= 0 && c < 0x20) || c == 0x7F; }, '?');
    if (!first_malformed_utf8(name)) {
      continue;
    }
    std::string text;
    for (const char c : name) {
      const auto byte = static_cast<unsigned char>(c);
      if (byte < 0x80) {
        text += c;
      } else {
        text += static_cast<char>(0xC0 | (byte >> 6));
        text += static_cast<char>(0x80 | (byte & 0x3F));
      }
    }
    name = std::move(text);
  }
  return names;
}

std::string separator_words(char separator) {
  switch (separator) {
    case ',': return "commas between the fields";
    case ';': return "semicolons between the fields";
    case '\t': return "tabs between the fields";
    default: return "blanks between the fields";
  }
}

// What the sentences of VectorNav hold, whose first field names them (VN-100 and VN-300 user manuals, ASCII messages); empty: another one.
std::vector<std::string> names_of_sentence(std::string_view first_field) {
  constexpr std::array sensors = {"MagX",           "MagY",           "MagZ",
                                  "AccelX [m/s^2]", "AccelY [m/s^2]", "AccelZ [m/s^2]",
                                  "GyroX [rad/s]",  "GyroY [rad/s]",  "GyroZ [rad/s]"};
  std::vector<std::string> before, behind;
  if (first_field == "$VNIMU") {
    before = {""};
    behind = {"Temp [C]", "Pressure"};
  } else if (first_field == "$VNYMR") {
    before = {"", "Yaw", "Pitch", "Roll"};
  } else {
    return {};
  }
  before.insert(before.end(), sensors.begin(), sensors.end());
  before.insert(before.end(), behind.begin(), behind.end());
  return before;
}

class TextSource final : public ColumnSource {
 public:
  TextSource(std::filesystem::path file, TextDialect dialect, std::optional<Labels> labels)
      : file_(std::move(file)), dialect_(std::move(dialect)), labelled_(std::move(labels)) {}

  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  const TextDialect* dialect() const override { return &dialect_; }
  std::string preamble() const override { return preamble_; }
  std::string form() const override {
    if (labelled_) {
      return "text, a label before each value";
    }
    const std::string names =
        dialect_.header_line > 0 ? fmt::format("names in line {}", dialect_.header_line)
        : dialect_.other_names > 0
            ? fmt::format("no names: {} stand above rows of {}, so that nobody knows whose they are",
                          dialect_.other_names, dialect_.fields)
            : "no names";
    return fmt::format("text, {}{}, {}", separator_words(dialect_.separator),
                       dialect_.decimal == ',' ? ", decimal commas" : "", names);
  }
  Expected<ColumnData> read(const ColumnRequest& request) const override;

  std::vector<std::string> labels(std::size_t column) const override;

  // Names, units and the number of columns, from the head of the file.
  Expected<void> read_head();

 private:
  tl::unexpected<Error> bad(std::size_t line, std::string_view what) const {
    return fail(ErrorKind::bad_input, fmt::format("{}: line {}: {}", file_.string(), line, what));
  }
  Expected<void> take(const ColumnRequest& request, const std::vector<std::string_view>& fields, std::size_t line,
                      ColumnData& data) const;
  // Fields of a line; false: it is none of the table's.
  bool fields_of(std::string_view line, std::vector<std::string_view>& fields) const {
    if (labelled_) {
      return labelled_fields(line, *labelled_, fields);
    }
    split_fields(line, dialect_.separator, fields);
    return true;
  }
  bool passed_over(std::string_view line) const {
    return line.empty() || (!dialect_.comment.empty() && line.starts_with(dialect_.comment));
  }

  std::filesystem::path file_;
  TextDialect dialect_;
  std::optional<Labels> labelled_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
  std::string preamble_;
};

Expected<void> TextSource::read_head() {
  if (labelled_) {
    names_ = as_utf8(labelled_->names);
    units_ = labelled_->units;
    return {};
  }
  Expected<LineReader> reader = LineReader::open(file_);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  std::string_view line;
  std::vector<std::string_view> fields;
  for (;;) {
    const Expected<bool> more = reader->next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      return bad(reader->number(), fmt::format("ends before line {}, where the numbers begin", dialect_.first_line));
    }
    const std::size_t number = reader->number();
    if (number == dialect_.header_line) {
      names_ = as_utf8(header_fields(line, dialect_));
    }
    if (number == dialect_.unit_line) {
      units_ = as_utf8(header_fields(line, dialect_));
    }
    if (number < dialect_.first_line) {
      preamble_.append(line.substr(0, 1000)).append("\n");
    } else if (!passed_over(trimmed(line))) {
      split_fields(line, dialect_.separator, fields);
      break;
    }
  }
  if (const std::vector<std::string> known = names_of_sentence(fields.front()); known.size() == fields.size()) {
    names_ = known;
  }
  names_.resize(std::max(fields.size(), names_.size()));
  return {};
}

Expected<void> TextSource::take(const ColumnRequest& request, const std::vector<std::string_view>& fields,
                                std::size_t line, ColumnData& data) const {
  const auto wrong = [&](std::size_t column, std::string_view field, std::string_view expected) {
    return bad(line, fmt::format("{}: {}; {} is expected", title(column), shown(field), expected));
  };
  const auto field_at = [&](std::size_t column) {
    return column < fields.size() ? fields[column] : std::string_view{};
  };
  for (std::size_t k = 0; k < request.columns.size(); ++k) {
    const std::size_t column = request.columns[k];
    const auto value = grouped_number_of(field_at(column), dialect_);
    if (!request.tolerant) {
      if (column >= fields.size()) {
        return bad(line, fmt::format("{} fields; {} is wanted", fields.size(), title(column)));
      }
      if (!value || !std::isfinite(*value)) {
        return wrong(column, fields[column], value ? "a finite number" : "a number");
      }
    }
    data.values[k].push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  if (request.stamp) {
    const std::string_view field = field_at(*request.stamp);
    const auto stamp = request.stamp_is_date ? date_of(field) : long_number_of(field, dialect_);
    if (!request.tolerant && !(stamp && std::isfinite(*stamp))) {
      return wrong(*request.stamp, field, request.stamp_is_date ? "a date and time (ISO 8601)" : "a time, a number");
    }
    data.stamps.push_back(stamp.value_or(std::numeric_limits<long double>::quiet_NaN()));
  }
  return {};
}

Expected<ColumnData> TextSource::read(const ColumnRequest& request) const {
  Expected<LineReader> reader = LineReader::open(file_);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  ColumnData data;
  data.values.resize(request.columns.size());
  std::string_view line;
  std::vector<std::string_view> fields;
  for (;;) {
    const Expected<bool> more = reader->next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      break;
    }
    if (reader->number() < dialect_.first_line || passed_over(trimmed(line))) {
      continue;
    }
    if (data.rows == request.most_rows) {
      if (!request.tolerant) {
        return bad(reader->number(), fmt::format("more than {} lines of numbers", request.most_rows));
      }
      data.left_out = true;
      break;
    }
    if (!fields_of(line, fields)) {
      continue;
    }
    const std::size_t ahead = reader->number() - data.rows;
    if (data.skipped.empty() || data.skipped.back().second != ahead) {
      data.skipped.emplace_back(data.rows, ahead);
    }
    if (const auto taken = take(request, fields, reader->number(), data); !taken) {
      return tl::unexpected(taken.error());
    }
    ++data.rows;
  }
  data.first_line = data.skipped.empty() ? 0 : data.skipped.front().second;
  return data;
}

std::vector<std::string> TextSource::labels(std::size_t column) const {
  Expected<LineReader> reader = LineReader::open(file_);
  std::vector<std::string> found;
  std::string_view line;
  std::vector<std::string_view> fields;
  constexpr std::size_t fewest = 20, most = 8, one_in = 4;  // a flag that changes now and then tells no rows apart
  std::string before;
  std::size_t changes = 0, row = 0;
  while (reader && row < lines_to_judge && found.size() <= most) {
    const Expected<bool> more = reader->next(line);
    if (!more || !*more) {
      break;
    }
    if (reader->number() < dialect_.first_line || passed_over(trimmed(line))) {
      continue;
    }
    if (!fields_of(line, fields)) {
      continue;
    }
    ++row;
    if (column >= fields.size() || fields[column].empty() || number_of(fields[column], dialect_.decimal) ||
        date_of(fields[column])) {
      return {};
    }
    changes += fields[column] != before ? 1 : 0;
    before = fields[column];
    if (std::find(found.begin(), found.end(), fields[column]) == found.end()) {
      found.emplace_back(fields[column]);
    }
  }
  return found.size() < 2 || found.size() > most || row < fewest || one_in * changes < row ? std::vector<std::string>{}
                                                                                           : as_utf8(found);
}

Expected<std::vector<std::string>> first_lines(const std::filesystem::path& file) {
  Expected<LineReader> reader = LineReader::open(file);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  std::vector<std::string> lines;
  lines.reserve(lines_to_judge);
  std::string_view line;
  for (bool more = true; more && lines.size() < lines_to_judge;) {
    const Expected<bool> next = reader->next(line);
    if (!next) {
      return tl::unexpected(next.error());
    }
    more = *next;
    if (more) {
      lines.emplace_back(line);
    }
  }
  return lines;
}

// Bytes, two hexadecimal digits each.
bool is_hex_dump(const std::vector<std::string_view>& lines) {
  constexpr std::size_t fewest = 8, most_lines = 50;
  std::size_t rows = 0;
  bool letters = false;
  std::vector<std::string_view> fields;
  for (const std::string_view line : lines) {
    if (rows == most_lines) {
      break;
    }
    split_fields(line, ' ', fields);
    const auto is_byte = [](std::string_view f) {
      return f.size() == 2 && f.find_first_not_of("0123456789abcdefABCDEF") == std::string_view::npos;
    };
    if (fields.size() < fewest || !std::all_of(fields.begin(), fields.end(), is_byte)) {
      return false;
    }
    letters |= line.find_first_of("abcdefABCDEF") != std::string_view::npos;
    ++rows;
  }
  return rows > 2 && letters;
}

// What is known to be no table, and what makes one of it; empty: nothing known.
std::string known_words(const std::vector<std::string_view>& lines) {
  const auto first = std::find_if(lines.begin(), lines.end(), [](std::string_view l) { return !trimmed(l).empty(); });
  const std::string_view begin = first == lines.end() ? std::string_view() : trimmed(*first);
  if (begin == "[" || begin.starts_with("[{")) {
    return "JSON that is no object a line: `jq -c '.[]'` makes such lines of an array of objects";
  }
  if (begin == "{" || begin.starts_with("{\"")) {
    return "JSON that is no object a line: `jq -c '.NAME[]'` makes such lines of the array that is called NAME in it";
  }
  if (std::any_of(lines.begin(), lines.end(),
                  [](std::string_view l) { return trimmed(l) == "linear_acceleration:"; })) {
    return "what `topic echo` prints: `rostopic echo -p` or `ros2 topic echo --csv` prints columns";
  }
  if (is_hex_dump(lines)) {
    return "bytes in hexadecimal: the maker's program makes columns of their messages";
  }
  return {};
}

// How the head of the file shows that it is written: labels, where each line says what its values are.
struct Form {
  TextDialect dialect;
  std::optional<Labels> labels;
};

// Empatica's E4: its first line is when it began, in s since 1970, once for each column, the second how many rows a second holds.
bool empatica_head(const std::vector<std::string_view>& lines) {
  if (lines.size() < 3) {
    return false;
  }
  const auto all_alike = [](std::string_view line, double least, double most) {
    std::vector<std::string_view> fields;
    split_fields(line, ',', fields);
    const auto first = number_of(fields.front(), '.');
    return first && *first > least && *first < most &&
           std::all_of(fields.begin(), fields.end(), [&](std::string_view f) { return number_of(f, '.') == first; });
  };
  constexpr double year_2010 = 1262304000.0, year_2100 = 4102444800.0, fastest = 1000.0;
  return all_alike(lines[0], year_2010, year_2100) && all_alike(lines[1], 0.0, fastest);
}

Expected<Form> judged_form(const std::filesystem::path& file) {
  const Expected<std::vector<std::string>> lines = first_lines(file);
  if (!lines) {
    return tl::unexpected(lines.error());
  }
  const std::vector<std::string_view> views(lines->begin(), lines->end());
  if (is_hex_dump(views)) {
    return fail(
        ErrorKind::bad_input,
        fmt::format("{}: bytes in hexadecimal: the maker's program makes columns of their messages", file.string()));
  }
  Form form;
  form.labels = detect_labels(views, false);
  const auto dialect = form.labels ? std::nullopt : detect_dialect(views);
  if (!form.labels && (!dialect || dialect->header_line == 0)) {
    form.labels = detect_labels(views, true);
  }
  if (form.labels) {
    return form.labels->rival.empty()
               ? Expected<Form>(std::move(form))
               : fail(
                     ErrorKind::bad_input,
                     fmt::format("{}: lines of several kinds, ({}) and ({}): a file for each is read (grep makes them)",
                                 file.string(), fmt::join(form.labels->names, ", "), form.labels->rival));
  }
  if (const std::string known = known_words(views); !known.empty()) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {}", file.string(), known));
  }
  if (!dialect) {
    const std::string field = unread_field(views);
    return fail(ErrorKind::bad_input,
                fmt::format("{}: no lines of numbers: of the first {} none has two numbers between commas, semicolons, "
                            "tabs or blanks{}{}",
                            file.string(), views.size(), field.empty() ? "" : "; ", field));
  }
  form.dialect = *dialect;
  if (empatica_head(views)) {
    form.dialect.first_line = 3;
    return form;
  }
  // PSINS: three lines of initial values and scale factors stand before the samples, with as many fields.
  constexpr std::size_t psins_header_lines = 3;
  if (!lines->empty() && lines->front().find("PSINS-format") != std::string::npos &&
      lines->size() > form.dialect.first_line + psins_header_lines) {
    form.dialect.first_line += psins_header_lines;
    form.dialect.header_line = 0;
  }
  return form;
}

// By the names of its columns, or by their count: six without names are two triads.
bool holds_a_triad(const ColumnSource& source) {
  constexpr std::size_t two_triads = 6;
  const std::vector<NamedColumn> named = read_names(source.names(), source.units());
  const auto names = [&named](Role role) { return !triads_by_name(named, role).all.empty(); };
  return names(Role::gyro) || names(Role::accelerometer) || named.size() == two_triads;
}

}  // namespace

std::string ColumnData::place(std::size_t row) const {
  if (skipped.empty()) {
    return fmt::format("row {}", row);
  }
  std::size_t ahead = skipped.front().second;
  for (const auto& [first, by] : skipped) {
    ahead = first <= row ? by : ahead;
  }
  return fmt::format("line {}", row + ahead);
}

std::string ColumnSource::mixed_rows() const {
  for (std::size_t column = 0; column < names().size(); ++column) {
    if (const std::vector<std::string> words = labels(column); !words.empty()) {
      return fmt::format("rows of several sensors, which {} tells apart: {}: a file for each is read (grep makes them)",
                         title(column), fmt::join(words, ", "));
    }
  }
  return numbered_rows(*this);
}

std::string ColumnSource::title(std::size_t column) const {
  const std::string& name = column < names().size() ? names()[column] : std::string{};
  return name.empty() ? fmt::format("column {}", column + 1) : fmt::format("column {} ({})", column + 1, name);
}

Expected<std::unique_ptr<ColumnSource>> open_text(const std::filesystem::path& file,
                                                  const std::optional<TextDialect>& dialect) {
  Expected<Form> form = judged_form(file);
  std::unique_ptr<TextSource> table;
  if (form || dialect) {
    table = std::make_unique<TextSource>(file, dialect ? *dialect : form->dialect,
                                         form ? std::move(form->labels) : std::nullopt);
    if (const auto head = table->read_head(); !head) {
      return tl::unexpected(head.error());
    }
    const bool words_tell_rows_apart = !table->mixed_rows().empty() && numbered_rows(*table).empty();
    if (form && !words_tell_rows_apart) {
      return table;
    }
  }
  Expected<std::unique_ptr<ColumnSource>> repeated = open_repeated_lines(file);
  if (repeated && *repeated && holds_a_triad(**repeated)) {
    return repeated;
  }
  return table ? Expected<std::unique_ptr<ColumnSource>>(std::move(table)) : tl::unexpected(form.error());
}

}  // namespace selfcal::import
