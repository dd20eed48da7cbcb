#include "protocol/profile/raw_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <vector>

namespace selfcal::profile {
namespace {

constexpr std::size_t longest_pattern = 200;
constexpr std::size_t most_digits = 10;  // of a u32

struct Part {
  enum class Kind : std::uint8_t { text, run, page } kind = Kind::text;
  std::string text;
  int digits = 1;  // at least
};

// nullopt: a brace that is none of ours.
std::optional<std::vector<Part>> parts_of(std::string_view pattern) {
  std::vector<Part> parts;
  while (!pattern.empty()) {
    if (pattern.front() != '{') {
      const std::string_view text = pattern.substr(0, pattern.find('{'));
      if (std::ranges::find(text, '}') != text.end()) {
        return std::nullopt;
      }
      parts.push_back({Part::Kind::text, std::string(text), 0});
      pattern.remove_prefix(text.size());
      continue;
    }
    const std::size_t end = pattern.find('}');
    if (end == std::string_view::npos) {
      return std::nullopt;
    }
    const std::string_view inside = pattern.substr(1, end - 1);
    const std::size_t colon = std::min(inside.find(':'), inside.size());
    Part part;
    part.kind = inside.substr(0, colon) == "page" ? Part::Kind::page : Part::Kind::run;
    if (colon < inside.size()) {
      const std::string_view digits = inside.substr(colon + 1);
      const auto [last, error] = std::from_chars(digits.data(), digits.data() + digits.size(), part.digits);
      if (error != std::errc{} || last != digits.data() + digits.size() || part.digits < 1 ||
          part.digits > static_cast<int>(most_digits)) {
        return std::nullopt;
      }
    }
    if (part.kind == Part::Kind::run && inside.substr(0, colon) != "run") {
      return std::nullopt;
    }
    parts.push_back(part);
    pattern.remove_prefix(end + 1);
  }
  return parts;
}

std::string name_of(const std::vector<Part>& parts, std::uint32_t run, std::uint32_t page) {
  std::string name;
  for (const Part& part : parts) {
    name += part.kind == Part::Kind::text
                ? part.text
                : fmt::format("{:0{}}", part.kind == Part::Kind::run ? run : page, part.digits);
  }
  return name;
}

}  // namespace

std::string fault_of_file_pattern(std::string_view pattern) {
  const auto printable = [](char c) { return c > 0x20 && c < 0x7F; };
  if (pattern.empty() || pattern.size() > longest_pattern || !std::ranges::all_of(pattern, printable)) {
    return fmt::format("1 to {} printable characters without a blank are expected", longest_pattern);
  }
  const auto parts = parts_of(pattern);
  if (!parts) {
    return "only {run}, {page} and, with a number of digits, {page:6} may stand in braces";
  }
  const auto pages = std::ranges::count_if(*parts, [](const Part& part) { return part.kind == Part::Kind::page; });
  return pages == 1 ? "" : "{page} must stand in it once: a file is one page";
}

std::string file_name(std::string_view pattern, std::uint32_t run, std::uint32_t page) {
  const auto parts = parts_of(pattern);
  return parts ? name_of(*parts, run, page) : std::string();
}

// The text before {page} is known, so what follows it can only be the number.
std::optional<std::uint32_t> page_of_file(std::string_view pattern, std::uint32_t run, std::string_view name) {
  const auto parts = parts_of(pattern);
  if (!parts) {
    return std::nullopt;
  }
  const auto at = std::ranges::find(*parts, Part::Kind::page, &Part::kind);
  const std::size_t before = name_of({parts->begin(), at}, run, 0).size();
  if (before > name.size()) {
    return std::nullopt;
  }
  const std::string_view rest = name.substr(before, most_digits);
  for (std::size_t digits = rest.size(); digits > 0; --digits) {
    std::uint32_t page = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + digits, page);
    if (error == std::errc{} && end == rest.data() + digits && name_of(*parts, run, page) == name) {
      return page;
    }
  }
  return std::nullopt;
}

}  // namespace selfcal::profile
