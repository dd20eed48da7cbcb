#include "protocol/toml_file/toml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <vector>

#include "protocol/toml_file/utf8.hpp"

namespace selfcal {
namespace {

// Behind the string or comment that begins at `at`; the end of the text where it is not closed.
std::size_t past_string_or_comment(std::string_view text, std::size_t at) {
  const char quote = text[at];
  if (quote == '#') {
    return std::min(text.find('\n', at), text.size());
  }
  const std::string_view rest = text.substr(at);
  const bool many_lines = rest.size() > 2 && rest[1] == quote && rest[2] == quote;
  const std::size_t quotes = many_lines ? 3 : 1;
  const std::string closing(quotes, quote);
  for (std::size_t k = at + quotes; k < text.size(); ++k) {
    if (text[k] == '\\' && quote == '"') {
      ++k;
    } else if (text.substr(k, quotes) == closing) {
      return k + quotes;
    } else if (text[k] == '\n' && !many_lines) {
      return k;
    }
  }
  return text.size();
}

// A quote in the midst of a number or a name opens nothing.
bool opens_string(std::string_view text, std::size_t at) {
  constexpr std::string_view before = " \t\r\n=[{,.";
  return (text[at] == '"' || text[at] == '\'') && (at == 0 || before.find(text[at - 1]) != std::string_view::npos);
}

struct Fault {
  std::size_t place;
  std::string what;
};

// toml++ limits the nesting of values to 256, but a key of a million parts makes as many tables, each destroyed by the
// one around it: the stack ends first. None of our files has more than three parts.
constexpr int most_dots = 16;

// Where the header of a table that begins at `at` has something else than a key: toml++ takes a key for granted there, and goes
// on into undefined behaviour. What is well here is `]`, which it refuses itself.
std::optional<std::size_t> header_without_key(std::string_view text, std::size_t at) {
  constexpr std::string_view blanks = " \t";
  const auto skip = [&](std::size_t k) { return std::min(text.find_first_not_of(blanks, k), text.size()); };
  std::size_t k = skip(at + 1);
  if (k < text.size() && text[k] == '[') {
    k = skip(k + 1);
  }
  const auto begins_key = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_-\"']").find(c) != std::string_view::npos;
  };
  return k < text.size() && !begins_key(text[k]) ? std::optional(k) : std::nullopt;
}

// The first byte that is not UTF-8, or not ASCII where TOML wants ASCII, the first key of too many parts, and the first header
// without a key.
std::optional<Fault> first_fault(std::string_view text) {
  const auto of_byte = [&](std::size_t k) {
    return Fault{k, fmt::format("byte 0x{:02X} is not UTF-8, outside a string and a comment, or of plane 15",
                                static_cast<unsigned char>(text[k]))};
  };
  if (const auto malformed = first_malformed_utf8(text)) {
    return of_byte(*malformed);
  }
  if (const auto reserved = first_of_plane_15(text)) {
    return of_byte(*reserved);
  }
  int dots = 0, depth = 0;  // of arrays and inline tables
  bool line_begins = true;
  for (std::size_t k = 0; k < text.size();) {
    constexpr std::string_view between_keys = "=[{,\n";
    if (text[k] == '#' || opens_string(text, k)) {
      k = past_string_or_comment(text, k);
      line_begins = false;
      continue;
    }
    if (static_cast<unsigned char>(text[k]) >= 0x80) {
      return of_byte(k);
    }
    dots = text[k] == '.' ? dots + 1 : between_keys.find(text[k]) != std::string_view::npos ? 0 : dots;
    if (dots > most_dots) {
      return Fault{k, fmt::format("a key of more than {} parts", most_dots + 1)};
    }
    const bool header = text[k] == '[' && line_begins && depth == 0;
    if (header) {
      if (const auto other = header_without_key(text, k)) {
        return Fault{*other, "the header of a table without a key"};
      }
    }
    const bool opens = text[k] == '[' || text[k] == '{', closes = text[k] == ']' || text[k] == '}';
    depth = header ? 0 : opens ? depth + 1 : closes ? std::max(0, depth - 1) : depth;
    line_begins = text[k] == '\n' || (line_begins && (text[k] == ' ' || text[k] == '\t' || text[k] == '\r'));
    ++k;
  }
  return std::nullopt;
}

// Keys are ordered by their text, so one that changes has to be taken out and put in again.
void put_back(toml::node& node) {  // NOLINT(misc-no-recursion): as deep as toml++ lets values nest, times most_dots
  if (toml::value<std::string>* text = node.as_string()) {
    text->get() = back_from_plane_15(text->get());
  } else if (toml::array* array = node.as_array()) {
    for (toml::node& element : *array) {
      put_back(element);
    }
  } else if (toml::table* table = node.as_table()) {
    std::vector<std::string> lifted;
    for (auto&& [key, value] : *table) {
      put_back(value);
      if (back_from_plane_15(key.str()) != key.str()) {
        lifted.emplace_back(key.str());
      }
    }
    for (const std::string& name : lifted) {
      const auto place = table->find(name);
      toml::key key(back_from_plane_15(name), toml::source_region{place->first.source()});
      table->insert(std::move(key), std::move(place->second));
      table->erase(name);
    }
  }
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return line;
}

Expected<toml::table> parse_toml(std::string_view text, std::string_view name) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) {
    text.remove_prefix(byte_order_mark.size());
  }
  if (const auto fault = first_fault(text)) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(fault->place), '\n');
    return fail(ErrorKind::bad_input, fmt::format("{}:{}: {}", name, line, fault->what));
  }
  // toml++ 3.3 takes some characters from U+00A1 to U+FEFF for impossible where it looks for white space: undefined
  // behaviour, found by fuzzing, wherever it takes for a string's outside what we take for its inside.
  toml::parse_result parsed = toml::parse(lifted_to_plane_15(text), name);
  if (!parsed) {
    const toml::parse_error& error = parsed.error();
    return fail(ErrorKind::bad_input, fmt::format("{}:{}: {}", name, error.source().begin.line,
                                                  one_line(back_from_plane_15(error.description()))));
  }
  toml::table table = std::move(parsed).table();
  put_back(table);
  return table;
}

}  // namespace selfcal
