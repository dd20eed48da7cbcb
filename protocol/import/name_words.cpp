#include "protocol/import/name_words.hpp"

#include <algorithm>

namespace selfcal::import {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_capital(char c) { return c >= 'A' && c <= 'Z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

Words words_of(std::string_view name) {
  constexpr std::string_view omega = "\xCF\x89", written = "omega ";
  if (const std::size_t at = name.find(omega); at != std::string_view::npos) {
    return words_of(std::string(name.substr(0, at)).append(written).append(name.substr(at + omega.size())));
  }
  Words words(1);
  char before = ' ';
  for (std::size_t k = 0; k < name.size(); ++k) {
    const char c = name[k];
    const bool capital = is_capital(c) && before >= 'a' && before <= 'z';
    // "AccelXMps2": an axis, and a unit.
    const bool behind_axis = is_capital(c) && before >= 'X' && before <= 'Z' && words.back().size() == 1 &&
                             k + 1 < name.size() && is_letter(name[k + 1]) && !is_capital(name[k + 1]);
    if (!is_letter(c) && !is_digit(c)) {
      words.emplace_back();
    } else {
      if (capital || behind_axis) {
        words.emplace_back();
      }
      words.back() += lower(c);
    }
    before = c;
  }
  std::erase(words, std::string());
  // "UnCompGyroX" says "uncomp".
  for (std::size_t k = 0; k + 1 < words.size(); ++k) {
    if (words[k] == "un") {
      words[k] += words[k + 1];
      words.erase(words.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    }
  }
  return words;
}

bool holds(const Words& words, std::initializer_list<std::string_view> parts) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return std::any_of(parts.begin(), parts.end(),
                       [&](std::string_view part) { return word.find(part) != std::string::npos; });
  });
}

bool name_says(std::string_view name, std::initializer_list<std::string_view> parts) {
  return std::any_of(parts.begin(), parts.end(), [&name](std::string_view part) {
    return std::search(name.begin(), name.end(), part.begin(), part.end(),
                       [](char a, char b) { return lower(a) == b; }) != name.end();
  });
}

bool is_one_of(const Words& words, std::initializer_list<std::string_view> whole) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return std::any_of(whole.begin(), whole.end(), [&](std::string_view one) { return word == one; });
  });
}

}  // namespace selfcal::import
