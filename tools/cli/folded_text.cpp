#include "tools/cli/folded_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace selfcal::cli {
namespace {

std::vector<std::string> words_of(const std::string& sentence) {
  std::vector<std::string> words;
  std::size_t from = 0;
  while (from < sentence.size()) {
    const std::size_t to = std::min(sentence.find(' ', from), sentence.size());
    words.push_back(sentence.substr(from, to - from));
    from = to + 1;
  }
  return words;
}

}  // namespace

std::string wrapped(const std::string& start, const std::vector<std::string>& parts, const std::string& separator) {
  constexpr std::size_t indent = 2;
  std::string text = start;
  std::size_t used = start.size();
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string part = parts[k] + (k + 1 < parts.size() ? separator : "");
    if (used > start.size() && used + 1 + part.size() > terminal_columns) {
      text += fmt::format("\n{:{}}", "", indent - 1);
      used = indent - 1;
    }
    text += " " + part;
    used += 1 + part.size();
  }
  return text + "\n";
}

std::string lines_of(const std::string& start, const std::string& sentence) {
  return wrapped(start, words_of(sentence), "");
}

std::string folded(const std::string& text) {
  std::string all;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = text.find('\n', from);
    const std::string line = text.substr(from, to - from);
    const std::size_t end = std::min(line.find(' ', line.find_first_not_of(' ')), line.size());
    all += lines_of(line.substr(0, end), end < line.size() ? line.substr(end + 1) : "");
    from = to + 1;
  }
  return all;
}

}  // namespace selfcal::cli
