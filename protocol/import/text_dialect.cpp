#include "protocol/import/text_dialect.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "protocol/import/guess_names.hpp"

namespace selfcal::import {
namespace {

constexpr std::string_view degree_sign = "\xC2\xB0";
constexpr std::array<std::string_view, 5> comment_marks{"#", "%", "//", "!", "*"};

std::string_view comment_of(std::string_view line) {
  const std::string_view text = trimmed(line);
  for (const std::string_view mark : comment_marks) {
    if (text.starts_with(mark)) {
      return mark;
    }
  }
  return {};
}

// "1.234.567,8": digits in threes with the points that spreadsheets put between them where the decimal mark is a comma. Empty: none.
std::string without_thousands(std::string_view field) {
  const std::size_t whole = std::min(field.find(','), field.size());
  std::string text;
  std::size_t digits = 0, groups = 0;
  for (std::size_t k = 0; k < whole; ++k) {
    const char c = field[k];
    if (c == '.') {
      if (digits == 0 || digits > 3 || (groups > 0 && digits != 3)) {
        return {};
      }
      ++groups;
      digits = 0;
    } else if (c >= '0' && c <= '9') {
      ++digits;
      text += c;
    } else if (k == 0 && (c == '-' || c == '+')) {
      text += c == '-' ? "-" : "";
    } else {
      return {};
    }
  }
  return groups > 0 && digits == 3 ? text + std::string(field.substr(whole)) : std::string();
}

// 12°30'15": degrees, minutes and seconds of an angle. Empty: none.
template <typename Number>
std::optional<Number> sexagesimal(std::string_view field, char decimal);

// "[0.5", "0.5)", "0.5f},": what a list of a program puts around a number.
std::string_view without_brackets(std::string_view field) {
  constexpr std::string_view opening = "[({", closing = "])},;";
  const std::size_t first = std::min(field.find_first_not_of(opening), field.size());
  field.remove_prefix(first);
  const std::size_t last = field.find_last_not_of(closing);
  field = field.substr(0, last == std::string_view::npos ? 0 : last + 1);
  const bool single =
      field.size() > 1 && (field.back() == 'f' || field.back() == 'F') && field.find('.') != std::string_view::npos;
  return trimmed(single ? field.substr(0, field.size() - 1) : field);
}

template <typename Number>
std::optional<Number> parsed(std::string_view field, char decimal) {
  std::array<char, 64> buffer{};
  constexpr std::string_view around = "[]{}();,fF";
  if (!field.empty() &&
      (around.find(field.front()) != std::string_view::npos || around.find(field.back()) != std::string_view::npos)) {
    if (const std::string_view bare = without_brackets(field);
        bare.size() < field.size() && field.find('x') == std::string_view::npos) {
      return parsed<Number>(bare, decimal);
    }
  }
  if (field.starts_with('+')) {
    field.remove_prefix(1);
    if (field.starts_with('-')) {
      return std::nullopt;
    }
  }
  // As written, where it can be: most fields need no copy.
  Number value{};
  if (field.size() > 2 && field[0] == '0' && (field[1] == 'x' || field[1] == 'X')) {
    unsigned long word = 0;
    const auto [stopped, error] = std::from_chars(field.data() + 2, field.data() + field.size(), word, 16);
    return error == std::errc{} && stopped == field.data() + field.size()
               ? std::optional<Number>(static_cast<Number>(word))
               : std::nullopt;
  }
  const auto whole = [&value](const char* begin, const char* end) {
    const auto [stopped, error] = std::from_chars(begin, end, value);
    return begin != end && error == std::errc{} && stopped == end;
  };
  if (decimal == '.' && whole(field.data(), field.data() + field.size())) {
    return value;
  }
  if (field.size() > buffer.size() || (decimal != '.' && field.find('.') != std::string_view::npos)) {
    return std::nullopt;
  }
  if (field.find(degree_sign) != std::string_view::npos) {
    return sexagesimal<Number>(field, decimal);
  }
  std::transform(field.begin(), field.end(), buffer.begin(), [decimal](char c) {
    const bool fortran = c == 'D' || c == 'd';  // 1.0D+03
    return fortran ? 'e' : c == decimal ? '.' : c;
  });
  return whole(buffer.data(), buffer.data() + field.size()) ? std::optional<Number>(value) : std::nullopt;
}

template <typename Number>
std::optional<Number> sexagesimal(std::string_view field, char decimal) {
  const bool negative = field.starts_with('-');
  field.remove_prefix(negative ? 1 : 0);
  Number value{};
  Number part{1};
  constexpr Number sixty{60};
  for (const std::string_view mark : {degree_sign, std::string_view("'"), std::string_view("\"")}) {
    const std::size_t end = field.find(mark);
    if (end == std::string_view::npos) {
      break;
    }
    const std::string_view digits_of_part = trimmed(field.substr(0, end));
    const bool whole = digits_of_part.find_first_not_of("0123456789.,") == std::string_view::npos;
    const auto number = whole ? parsed<Number>(digits_of_part, decimal) : std::nullopt;
    if (!number || (part < Number{1} && *number >= sixty)) {
      return std::nullopt;
    }
    value += *number * part;
    part /= sixty;
    field = trimmed(field.substr(end + mark.size()));
  }
  return field.empty() && part < Number{1} ? std::optional<Number>(negative ? -value : value) : std::nullopt;
}

// "13 / 22": so many of so many, as of satellites.
bool is_share(std::string_view field) {
  const std::size_t slash = field.find(" / ");
  return slash != std::string_view::npos && number_of(trimmed(field.substr(0, slash)), '.') &&
         number_of(trimmed(field.substr(slash + 3)), '.');
}

// "10:12:00.123 -> ", which Arduino's serial monitor puts before a line: its length, and the time; 0: it does not stand there.
struct Arrival {
  std::string_view time;
  std::size_t length = 0;
};
Arrival arrival_of(std::string_view line) {
  constexpr std::string_view arrow = " -> ";
  constexpr std::size_t longest = 32;
  const std::string_view begin = line.substr(0, longest);
  const std::size_t at = begin.find(arrow);
  const std::string_view time = at == std::string_view::npos ? std::string_view() : trimmed(begin.substr(0, at));
  return !time.empty() && date_of(time) ? Arrival{time, at + arrow.size()} : Arrival{};
}

// "IMU:0.1,0.2,9.8": a word and a colon before the first number of a line, which are a field of their own; 0: there are none.
std::size_t mark_before_numbers(std::string_view line, char separator) {
  const std::string_view first = line.substr(0, line.find(separator));
  const std::size_t colon = first.find(':');
  if (first.size() == line.size() || colon == 0 || colon == std::string_view::npos ||
      line.find(':', colon + 1) != std::string_view::npos) {
    return 0;
  }
  const bool word = std::all_of(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(colon),
                                [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; });
  return word && number_of(trimmed(first.substr(colon + 1)), '.') ? colon + 1 : 0;
}

enum class Field { number, date, empty, word, wrong };

Field kind_of(std::string_view field, char decimal) {
  if (field.empty()) {
    return Field::empty;
  }
  if (number_of(field, decimal)) {
    return Field::number;
  }
  if (const std::string whole = decimal == ',' ? without_thousands(field) : std::string();
      !whole.empty() && number_of(whole, decimal)) {
    return Field::number;
  }
  if (date_of(field)) {
    return Field::date;
  }
  if (is_share(field)) {
    return Field::word;
  }
  // Numbers with a separator between them are a sign that the text is split in the wrong way; "2023-4-11 10:12:00" and "GPS fix" are none.
  std::size_t parts = 0, numbers = 0;
  for (std::string_view rest = field; !rest.empty();) {
    const std::size_t end = std::min(rest.find_first_of(",;\t "), rest.size());
    ++parts;
    numbers += number_of(rest.substr(0, end), '.') ? 1 : 0;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return parts < 2 || numbers == 0 ? Field::word : Field::wrong;
}

// Number of fields of a line of numbers (a date and a few words may be among them), 0 for any other.
std::size_t numeric_fields(std::string_view line, char separator, char decimal, std::vector<std::string_view>& fields) {
  split_fields(line, separator, fields);
  std::size_t numbers = 0, words = 0, empty = 0;
  for (const std::string_view field : fields) {
    const Field kind = kind_of(field, decimal);
    if (kind == Field::wrong) {
      return 0;
    }
    numbers += kind == Field::number ? 1 : 0;
    words += kind == Field::word ? 1 : 0;
    empty += kind == Field::empty ? 1 : 0;
  }
  // A row of a table of which most lacks: its number, and a time that no date is.
  const bool sparse = words == numbers && 2 * empty > fields.size();
  return numbers > 0 && (words < numbers || sparse) ? fields.size() : 0;
}

struct Run {
  std::size_t first = 0;  // index of the line
  std::size_t lines = 0;
  std::size_t fields = 0;
  bool open = false;  // the last field is empty
};

// The longest run of lines with the same number of numeric fields.
Run longest_run(const std::vector<std::string_view>& lines, char separator, char decimal, std::size_t fewest = 2) {
  Run best;
  Run run;
  std::vector<std::string_view> fields;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (trimmed(lines[k]).empty() || !comment_of(lines[k]).empty()) {
      continue;
    }
    const std::size_t count = numeric_fields(lines[k], separator, decimal, fields);
    if (count != run.fields) {
      run = {k, 0, count, count > 0 && fields.back().empty()};
    }
    ++run.lines;
    if (run.fields >= fewest && run.lines > best.lines) {
      best = run;
    }
  }
  return best;
}

bool is_unit(std::string_view field) {
  constexpr std::array<std::string_view, 35> known{
      "na",    "s",      "ms",     "us",   "ns",     "sec",   "rad",   "deg",    "rad/s", "deg/s", "deg/h",   "dps",
      "m/s^2", "m/s2",   "m/s",    "g",    "mg",     "ug",    "c",     "degc",   "k",     "f",     "degf",    "hz",
      "-",     "counts", "arcsec", "mrad", "mrad/s", "rad/h", "ft/s2", "ft/s^2", "m/s/s", "ug*s",  "arcsec/s"};
  std::string lower(field);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return std::find(known.begin(), known.end(), lower) != known.end() || lower.find("\xC2\xB0") != std::string::npos ||
         !known_unit(field).empty();
}

// Index of the line of names above the numbers, and of the units between them.
void find_header(const std::vector<std::string_view>& lines, const Run& run, TextDialect& dialect) {
  const auto count = [&](std::size_t k) { return header_fields(lines[k], dialect); };
  const auto fits = [&](const std::vector<std::string>& fields) {
    // Where each row of numbers has a separator behind its last field, that of the names may have none, and the other way round.
    const bool one_off =
        (run.open && fields.size() + 1 == run.fields) || (fields.size() == run.fields + 1 && fields.back().empty());
    return (fields.size() == run.fields || one_off) &&
           std::none_of(fields.begin(), fields.end(),
                        [&](const std::string& f) { return number_of(f, dialect.decimal).has_value(); });
  };
  std::size_t k = run.first;
  while (k > 0 && trimmed(lines[k - 1]).empty()) {
    --k;
  }
  if (k == 0) {
    return;
  }
  const std::vector<std::string> nearest = count(k - 1);
  if (!fits(nearest)) {
    constexpr std::size_t fewest = 4;
    const bool names = nearest.size() >= fewest && std::none_of(nearest.begin(), nearest.end(), [&](const auto& f) {
                         return number_of(f, dialect.decimal).has_value();
                       });
    dialect.other_names = names ? nearest.size() : 0;
    return;
  }
  const auto units = std::count_if(nearest.begin(), nearest.end(), [](const std::string& f) { return is_unit(f); });
  if (k > 1 && 2 * static_cast<std::size_t>(units) > run.fields && fits(count(k - 2))) {
    dialect.unit_line = k;
    dialect.header_line = k - 1;
    return;
  }
  dialect.header_line = k;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\v\f";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

void split_fields(std::string_view line, char separator, std::vector<std::string_view>& fields) {
  fields.clear();
  if (const Arrival arrival = arrival_of(line); arrival.length > 0) {
    fields.push_back(arrival.time);
    line.remove_prefix(arrival.length);
  }
  if (const std::size_t mark = separator == ' ' ? 0 : mark_before_numbers(line, separator); mark > 0) {
    fields.push_back(line.substr(0, mark - 1));
    line.remove_prefix(mark);
  }
  if (separator == ' ') {
    constexpr std::string_view blanks = " \t";
    for (line = trimmed(line); !line.empty(); line = trimmed(line)) {
      const std::size_t end = line.find_first_of(blanks);
      fields.push_back(line.substr(0, end));
      line.remove_prefix(std::min(end, line.size()));
    }
    return;
  }
  // "$VNIMU,...*61": a checksum behind a sentence is no part of its last field.
  constexpr std::size_t longest_checksum = 9;
  if (line.starts_with('$')) {
    const std::string_view text = trimmed(line);
    const std::size_t star = text.rfind('*');
    line = star != std::string_view::npos && text.size() - star <= longest_checksum ? text.substr(0, star) : text;
  }
  for (bool more = true; more;) {
    const bool quoted = trimmed(line).starts_with('"');
    const std::size_t opening = quoted ? line.find('"') : 0;
    const std::size_t closing = quoted ? line.find('"', opening + 1) : std::string_view::npos;
    const std::size_t end = line.find(separator, closing == std::string_view::npos ? 0 : closing);
    std::string_view field = trimmed(line.substr(0, end));
    if (closing != std::string_view::npos && field.size() >= 2 && field.back() == '"') {
      field = trimmed(field.substr(1, field.size() - 2));
    }
    fields.push_back(field);
    more = end != std::string_view::npos;
    line.remove_prefix(more ? end + 1 : line.size());
  }
}

std::optional<double> number_of(std::string_view field, char decimal) { return parsed<double>(field, decimal); }

namespace {

template <typename Number>
std::optional<Number> grouped(std::string_view field, const TextDialect& dialect) {
  const auto plain = parsed<Number>(field, dialect.decimal);
  if (plain || dialect.decimal != ',' || field.find('.') == std::string_view::npos) {
    return plain;
  }
  const std::string text = without_thousands(field);
  return text.empty() ? std::nullopt : parsed<Number>(text, dialect.decimal);
}

}  // namespace

std::optional<double> grouped_number_of(std::string_view field, const TextDialect& dialect) {
  return grouped<double>(field, dialect);
}

std::optional<long double> long_number_of(std::string_view field, const TextDialect& dialect) {
  return grouped<long double>(field, dialect);
}

std::vector<std::string> header_fields(std::string_view line, const TextDialect& dialect) {
  const std::string_view mark = comment_of(line);
  // A tab at the end is behind a field, as in the rows of numbers.
  line = dialect.separator == '\t' ? line.substr(std::min(line.find_first_not_of(" \r"), line.size())) : trimmed(line);
  line.remove_prefix(mark.size());
  // "#Fields: t ax ay az"
  if (const std::size_t colon = line.find(':'); !mark.empty() && colon < trimmed(line).find_first_of(" \t,;")) {
    line.remove_prefix(colon + 1);
  }
  std::vector<std::string_view> fields;
  split_fields(line, dialect.separator, fields);
  std::vector<std::string> names;
  const bool arrived = arrival_of(line).length > 0;
  for (std::string_view field : fields) {
    if (arrived && names.empty()) {
      names.emplace_back("arrival time");
      continue;
    }
    if (field.size() >= 2 &&
        ((field.front() == '[' && field.back() == ']') || (field.front() == '(' && field.back() == ')'))) {
      field = field.substr(1, field.size() - 2);
    }
    names.emplace_back(field);
  }
  return names;
}

std::string unread_field(const std::vector<std::string_view>& lines) {
  const auto last = std::find_if(lines.rbegin(), lines.rend(), [](std::string_view l) { return !trimmed(l).empty(); });
  std::vector<std::string_view> fields;
  for (const char separator : {'\t', ';', ','}) {
    if (last == lines.rend()) {
      break;
    }
    split_fields(*last, separator, fields);
    constexpr std::size_t fewest = 4, longest = 40;
    const auto wrong = std::find_if(fields.begin(), fields.end(),
                                    [](std::string_view field) { return kind_of(field, '.') == Field::wrong; });
    if (fields.size() < fewest || wrong == fields.end()) {
      continue;
    }
    std::string text(wrong->substr(0, longest));
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return fmt::format("line {}, field {}: \"{}\" is no number, no date and no word", lines.rend() - last,
                       wrong - fields.begin() + 1, text);
  }
  return {};
}

std::optional<TextDialect> detect_dialect(const std::vector<std::string_view>& lines) {
  struct Way {
    char separator, decimal;
  };
  // Earlier ones are preferred where two read the same lines.
  constexpr std::array<Way, 7> ways{
      {{'\t', '.'}, {';', '.'}, {',', '.'}, {' ', '.'}, {'\t', ','}, {';', ','}, {' ', ','}}};
  Run best;
  TextDialect dialect;
  for (const Way& way : ways) {
    const Run run = longest_run(lines, way.separator, way.decimal);
    // Blanks may stand in a field, as between a date and a time.
    const bool finer = run.lines == best.lines && run.fields > best.fields && (way.separator != ' ' || best.fields < 2);
    if (run.lines > best.lines || finer) {
      best = run;
      dialect.separator = way.separator;
      dialect.decimal = way.decimal;
    }
  }
  if (best.fields < 2) {
    // Quoted numbers with decimal commas between commas.
    best = longest_run(lines, ',', ',');
    dialect.separator = dialect.decimal = ',';
  }
  if (best.fields < 2) {
    // One column of numbers and little else.
    constexpr std::size_t fewest_lines = 100;
    best = longest_run(lines, ',', '.', 1);
    dialect.separator = ',';
    dialect.decimal = '.';
    if (best.fields != 1 || best.lines < fewest_lines || 10 * best.lines < 9 * lines.size()) {
      return std::nullopt;
    }
  }
  dialect.first_line = best.first + 1;
  dialect.fields = best.fields;
  for (const std::string_view line : lines) {
    if (const std::string_view mark = comment_of(line); !mark.empty() && dialect.comment.empty()) {
      dialect.comment = std::string(mark);
    }
  }
  find_header(lines, best, dialect);
  return dialect;
}

}  // namespace selfcal::import
