#include "protocol/import/repeated_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "protocol/import/guess_names.hpp"
#include "protocol/import/line_reader.hpp"
#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {
namespace {

constexpr std::size_t lines_to_judge = 2000, most_lines = 40, fewest_values = 3, most_values = 200;
constexpr std::size_t longest_line = 4096;  // nobody reads more

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// Characters of a number or a date at the beginning of TEXT; 0: none. BEFORE: the character in front of it.
std::size_t length_of_value(std::string_view text, char before) {
  if (is_letter(before) || is_digit(before) || before == '_' || before == '^' || before == '.') {
    return 0;
  }
  const std::size_t end = std::min(text.find_first_of(" \t\r,;|()[]{}<>\"'="), text.size());
  const std::string_view word = text.substr(0, end);
  if (word.empty()) {
    return 0;
  }
  if (number_of(word, '.') || date_of(word)) {
    return word.size();
  }
  // "0.98g": a unit behind it, no word that begins with a digit.
  std::size_t length = word.front() == '-' || word.front() == '+' ? 1 : 0;
  while (length < word.size() && (is_digit(word[length]) || word[length] == '.')) {
    ++length;
  }
  const bool unit = length < word.size() && !known_unit(word.substr(length)).empty();
  return unit && number_of(word.substr(0, length), '.') ? length : 0;
}

// Lines of one sample: the words of each.
struct Pattern {
  std::vector<std::string> lines;
  std::vector<std::string> names, units;  // of the values of all of them
};

// Words before a number, without what stands around them.
std::string label_of(std::string_view chunk) {
  const std::size_t cut = chunk.find_last_of(",;|");
  if (cut != std::string_view::npos) {
    chunk = chunk.substr(cut + 1);
  }
  while (!chunk.empty() &&
         (is_blank(chunk.front()) || std::string_view("]})>\"'").find(chunk.front()) != std::string_view::npos)) {
    chunk.remove_prefix(1);
  }
  while (!chunk.empty() &&
         (is_blank(chunk.back()) || std::string_view("[{(<=:\"'+-").find(chunk.back()) != std::string_view::npos)) {
    chunk.remove_suffix(1);
  }
  std::string label;
  for (const char c : chunk) {
    label += c == ':' || is_blank(c) ? ' ' : c;
  }
  return std::any_of(label.begin(), label.end(), is_letter) ? label : std::string();
}

// Takes "in g's" out of a label: "g".
std::string take_unit_in(std::string& label) {
  const std::size_t at = label.find(" in ");
  if (at == std::string::npos) {
    return {};
  }
  constexpr std::size_t length = 4;
  const std::size_t end = std::min(label.find(' ', at + length), label.size());
  std::string word = label.substr(at + length, end - at - length);
  if (word.ends_with("'s")) {
    word.resize(word.size() - 2);
  }
  std::string unit = known_unit(word);
  if (!unit.empty()) {
    label.erase(at, end - at);
  }
  return unit;
}

bool is_axis(std::string_view word) {
  return word.size() == 1 && std::string_view("xyzXYZ").find(word.front()) != std::string_view::npos;
}

class Namer {
 public:
  void add(std::string_view line) {
    const Skeleton found = skeleton_of(line);
    if (found.values.empty()) {
      const std::string_view text = trimmed(line);
      section_ = text.ends_with(':') ? std::string(text.substr(0, text.size() - 1)) : std::string();
      return;
    }
    stem_ = section_;
    base_.clear();
    const std::size_t first = names_.size();
    const char* at = line.data();
    for (const std::string_view value : found.values) {
      add_value(label_of({at, static_cast<std::size_t>(value.data() - at)}));
      at = value.data() + value.size();
    }
    const std::string_view behind = trimmed(line.substr(static_cast<std::size_t>(at - line.data())));
    const std::string unit = known_unit(behind.substr(0, behind.find_first_of(" \t,;|)")));
    for (std::size_t k = first; k < names_.size(); ++k) {
      units_[k] = units_[k].empty() ? unit : units_[k];
    }
  }

  void fill(Pattern& pattern) {
    pattern.names = std::move(names_);
    pattern.units = std::move(units_);
  }

 private:
  void add_value(std::string label) {
    std::string unit = take_unit_in(label);
    if (label.empty()) {
      count(unit);
      return;
    }
    const std::size_t last = label.find_last_of(' ');
    const std::string_view word = std::string_view(label).substr(last == std::string::npos ? 0 : last + 1);
    if (is_axis(label)) {
      label = stem_.empty() ? label : stem_ + " " + label;
      unit = unit.empty() ? unit_of_stem_ : unit;
    } else if (is_axis(word)) {
      stem_ = label.substr(0, last);
      unit_of_stem_ = unit;
    } else {
      label = section_.empty() ? label : section_ + " " + label;
      unit_of_stem_.clear();
    }
    base_ = label;
    index_ = 0;
    names_.push_back(std::move(label));
    units_.push_back(std::move(unit));
  }
  // Behind a number without words between them.
  void count(const std::string& unit) {
    if (!base_.empty() && index_ == 0) {
      names_.back() += "[0]";
    }
    names_.push_back(base_.empty() ? std::string() : fmt::format("{}[{}]", base_, ++index_));
    units_.push_back(unit);
  }

  std::vector<std::string> names_, units_;
  std::string section_, stem_, base_, unit_of_stem_;
  std::size_t index_ = 0;
};

// How many lines a sample takes, 0: they do not repeat.
std::size_t period_of(const std::vector<std::string>& lines) {
  constexpr std::size_t fewest_samples = 20;
  const std::size_t head = lines.size() / 4;
  for (std::size_t period = 1; period <= most_lines && (period + 1) * fewest_samples < lines.size() + fewest_samples;
       ++period) {
    std::size_t same = 0, all = 0;
    for (std::size_t k = std::max(head, period); k < lines.size(); ++k, ++all) {
      same += lines[k] == lines[k - period] ? 1 : 0;
    }
    constexpr double nearly = 0.97;
    if (all > fewest_samples && static_cast<double>(same) > nearly * static_cast<double>(all)) {
      return period;
    }
  }
  return 0;
}

// Lines that are not empty, and which of them stand behind an empty one.
struct Text {
  std::vector<std::string> lines, skeletons;
  std::vector<bool> apart;
};

std::optional<Pattern> pattern_of(const Text& text) {
  const std::size_t period = period_of(text.skeletons);
  if (period == 0) {
    return std::nullopt;
  }
  // A whole sample in the middle, from where an empty line stands before it; else from where the file begins to repeat.
  std::size_t first = 0;
  while (first + 2 * period <= text.lines.size() &&
         !std::equal(text.skeletons.begin() + static_cast<std::ptrdiff_t>(first),
                     text.skeletons.begin() + static_cast<std::ptrdiff_t>(first + period),
                     text.skeletons.begin() + static_cast<std::ptrdiff_t>(first + period))) {
    ++first;
  }
  if (first + 2 * period > text.lines.size()) {
    return std::nullopt;
  }
  const auto behind_empty = [&](std::size_t phase) {
    std::size_t count = 0;
    for (std::size_t k = first + phase; k < text.apart.size(); k += period) {
      count += text.apart[k] ? 1 : 0;
    }
    return count;
  };
  std::size_t begin = 0;
  for (std::size_t phase = 1; phase < period; ++phase) {
    begin = behind_empty(phase) > behind_empty(begin) ? phase : begin;
  }
  Pattern pattern;
  Namer namer;
  for (std::size_t k = first + begin; k < first + begin + period; ++k) {
    pattern.lines.push_back(text.skeletons[k]);
    namer.add(text.lines[k]);
  }
  namer.fill(pattern);
  const std::size_t values = pattern.names.size();
  return values >= fewest_values && values <= most_values ? std::optional(std::move(pattern)) : std::nullopt;
}

Expected<Text> first_lines(const std::filesystem::path& file) {
  Expected<LineReader> reader = LineReader::open(file);
  if (!reader) {
    return tl::unexpected(reader.error());
  }
  Text text;
  std::string_view line;
  bool apart = false;
  while (text.lines.size() < lines_to_judge) {
    const Expected<bool> more = reader->next(line);
    if (!more) {
      return tl::unexpected(more.error());
    }
    if (!*more) {
      break;
    }
    if (trimmed(line).empty()) {
      apart = true;
      continue;
    }
    if (line.size() > longest_line) {
      return Text{};
    }
    text.lines.emplace_back(line);
    text.skeletons.push_back(skeleton_of(line).text);
    text.apart.push_back(std::exchange(apart, false));
  }
  return text;
}

class RepeatedLines final : public ColumnSource {
 public:
  RepeatedLines(std::filesystem::path file, Pattern pattern) : file_(std::move(file)), pattern_(std::move(pattern)) {}

  const std::vector<std::string>& names() const override { return pattern_.names; }
  const std::vector<std::string>& units() const override { return pattern_.units; }
  std::string form() const override {
    return fmt::format("text, each sample in {} of words and numbers",
                       pattern_.lines.size() == 1 ? "a line" : fmt::format("{} lines", pattern_.lines.size()));
  }
  const TextDialect* dialect() const override { return nullptr; }
  std::string preamble() const override { return {}; }
  std::vector<std::string> labels(std::size_t /*column*/) const override { return {}; }

  // A sample of which a line is missing or another is left out.
  Expected<ColumnData> read(const ColumnRequest& request) const override {
    Expected<LineReader> reader = LineReader::open(file_);
    if (!reader) {
      return tl::unexpected(reader.error());
    }
    ColumnData data;
    data.values.resize(request.columns.size());
    std::vector<std::string> fields;
    std::size_t next = 0;
    std::string_view line;
    for (;;) {
      const Expected<bool> more = reader->next(line);
      if (!more) {
        return tl::unexpected(more.error());
      }
      if (!*more) {
        return data;
      }
      if (trimmed(line).empty()) {
        continue;
      }
      const Skeleton found = skeleton_of(line);
      if (found.text != pattern_.lines[next]) {
        next = 0;
        fields.clear();
        if (found.text != pattern_.lines.front()) {
          continue;
        }
      }
      fields.insert(fields.end(), found.values.begin(), found.values.end());
      if (++next < pattern_.lines.size()) {
        continue;
      }
      if (data.rows == request.most_rows) {
        data.left_out = true;
        return data;
      }
      if (const auto taken = take(request, fields, reader->number(), data); !taken) {
        return tl::unexpected(taken.error());
      }
      next = 0;
      fields.clear();
    }
  }

 private:
  Expected<void> take(const ColumnRequest& request, const std::vector<std::string>& fields, std::size_t line,
                      ColumnData& data) const {
    const auto wrong = [&](std::size_t column, const char* expected) {
      return fail(ErrorKind::bad_input, fmt::format("{}: line {}: {}: \"{}\"; {} is expected", file_.string(), line,
                                                    title(column), fields[column], expected));
    };
    for (std::size_t k = 0; k < request.columns.size(); ++k) {
      const auto value = number_of(fields[request.columns[k]], '.');
      if (!request.tolerant && !(value && std::isfinite(*value))) {
        return wrong(request.columns[k], "a number");
      }
      data.values[k].push_back(value.value_or(std::numeric_limits<double>::quiet_NaN()));
    }
    if (request.stamp) {
      const std::string& field = fields[*request.stamp];
      const auto stamp = request.stamp_is_date ? date_of(field) : long_number_of(field, TextDialect{});
      if (!request.tolerant && !(stamp && std::isfinite(*stamp))) {
        return wrong(*request.stamp, request.stamp_is_date ? "a date and time (ISO 8601)" : "a time, a number");
      }
      data.stamps.push_back(stamp.value_or(std::numeric_limits<long double>::quiet_NaN()));
    }
    ++data.rows;
    return {};
  }

  std::filesystem::path file_;
  Pattern pattern_;
};

}  // namespace

Skeleton skeleton_of(std::string_view line) {
  Skeleton found;
  char before = ' ';
  for (std::size_t k = 0; k < line.size();) {
    if (is_blank(line[k])) {
      if (!found.text.empty() && found.text.back() != ' ') {
        found.text += ' ';
      }
      before = line[k++];
      continue;
    }
    if (const std::size_t length = length_of_value(line.substr(k), before); length > 0) {
      found.values.push_back(line.substr(k, length));
      found.text += '#';
      k += length;
      before = ' ';
      continue;
    }
    found.text += line[k];
    before = line[k++];
  }
  if (found.text.ends_with(' ')) {
    found.text.pop_back();
  }
  return found;
}

Expected<std::unique_ptr<ColumnSource>> open_repeated_lines(const std::filesystem::path& file) {
  const Expected<Text> text = first_lines(file);
  if (!text) {
    return tl::unexpected(text.error());
  }
  std::optional<Pattern> pattern = pattern_of(*text);
  return pattern ? std::unique_ptr<ColumnSource>(std::make_unique<RepeatedLines>(file, std::move(*pattern)))
                 : std::unique_ptr<ColumnSource>();
}

}  // namespace selfcal::import
