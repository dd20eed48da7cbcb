#include "protocol/import/text_source.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/import/line_reader.hpp"
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

class TextSource final : public ColumnSource {
 public:
  TextSource(std::filesystem::path file, TextDialect dialect) : file_(std::move(file)), dialect_(std::move(dialect)) {}

  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<std::string>& units() const override { return units_; }
  const TextDialect* dialect() const override { return &dialect_; }
  std::string preamble() const override { return preamble_; }
  std::string form() const override {
    return fmt::format("text, {}{}, {}", separator_words(dialect_.separator),
                       dialect_.decimal == ',' ? ", decimal commas" : "",
                       dialect_.header_line > 0 ? fmt::format("names in line {}", dialect_.header_line) : "no names");
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
  bool passed_over(std::string_view line) const {
    return line.empty() || (!dialect_.comment.empty() && line.starts_with(dialect_.comment));
  }

  std::filesystem::path file_;
  TextDialect dialect_;
  std::vector<std::string> names_;
  std::vector<std::string> units_;
  std::string preamble_;
};

Expected<void> TextSource::read_head() {
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
    const std::size_t ahead = reader->number() - data.rows;
    if (data.skipped.empty() || data.skipped.back().second != ahead) {
      data.skipped.emplace_back(data.rows, ahead);
    }
    split_fields(line, dialect_.separator, fields);
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
  constexpr std::size_t most = 8, one_in = 4;  // a flag that changes now and then tells no rows apart
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
    ++row;
    split_fields(line, dialect_.separator, fields);
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
  return found.size() < 2 || found.size() > most || one_in * changes < row ? std::vector<std::string>{}
                                                                           : as_utf8(found);
}

// Dialect that the head of the file shows.
Expected<TextDialect> judged_dialect(const std::filesystem::path& file) {
  Expected<LineReader> reader = LineReader::open(file);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  std::vector<std::string> lines;
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
  const std::vector<std::string_view> views(lines.begin(), lines.end());
  const auto dialect = detect_dialect(views);
  if (!dialect) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: no lines of numbers: of the first {} none has two numbers between commas, semicolons, "
                            "tabs or blanks",
                            file.string(), lines.size()));
  }
  // PSINS: three lines of initial values and scale factors stand before the samples, with as many fields.
  TextDialect found = *dialect;
  constexpr std::size_t psins_header_lines = 3;
  if (!lines.empty() && lines.front().find("PSINS-format") != std::string::npos &&
      lines.size() > found.first_line + psins_header_lines) {
    found.first_line += psins_header_lines;
    found.header_line = 0;
  }
  return found;
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
  TextDialect used;
  if (dialect) {
    used = *dialect;
  } else {
    Expected<TextDialect> judged = judged_dialect(file);
    if (!judged) {
      return tl::unexpected(judged.error());
    }
    used = std::move(*judged);
  }
  auto source = std::make_unique<TextSource>(file, used);
  if (const auto head = source->read_head(); !head) {
    return tl::unexpected(head.error());
  }
  return source;
}

}  // namespace selfcal::import
