#include "protocol/import/name_words.hpp"

#include <algorithm>

namespace selfcal::import {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
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
  for (const char c : name) {
    const bool capital = c >= 'A' && c <= 'Z' && before >= 'a' && before <= 'z';
    if (!is_letter(c) && !is_digit(c)) {
      words.emplace_back();
    } else {
      if (capital) {
        words.emplace_back();
      }
      words.back() += lower(c);
    }
    before = c;
  }
  std::erase(words, std::string());
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
