#include "protocol/profile/byte_picture.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace selfcal::profile {
namespace {

constexpr std::size_t row_bytes = 8;
constexpr std::size_t cell = 9;  // characters of a byte, its left border among them

struct Part {
  std::size_t begin, end;
  std::string label;
};

void add_fields(const std::vector<Field>& fields, std::size_t at, std::vector<Part>& parts) {
  for (const Field& field : fields) {
    for (std::size_t k = 0; k < field.count; ++k) {
      const std::size_t begin = at + field.at + k * field.type.bytes;
      const std::size_t end = begin + field.type.bytes;
      const auto same = std::ranges::find_if(parts, [&](const Part& p) { return p.begin == begin && p.end == end; });
      if (same != parts.end()) {  // bits of one integer
        same->label += "/" + field.name;
      } else {
        parts.push_back({begin, end, field.count > 1 ? fmt::format("{}[{}]", field.name, k) : field.name});
      }
    }
  }
}

std::string row(const std::vector<Part>& parts, std::size_t first, std::size_t last) {
  std::string line;
  for (std::size_t at = first; at < last;) {
    const auto part = std::ranges::find_if(parts, [&](const Part& p) { return at >= p.begin && at < p.end; });
    std::size_t end = at + 1;
    if (part != parts.end()) {
      end = std::min(part->end, last);
    } else {
      while (end < last && std::ranges::none_of(parts, [&](const Part& p) { return end >= p.begin && end < p.end; })) {
        ++end;
      }
    }
    const std::size_t room = (end - at) * cell - 1;
    const std::string label = part == parts.end() ? "-" : (at > part->begin ? "" : part->label);
    line += fmt::format("|{:^{}}", label.substr(0, room), room);
    at = end;
  }
  return line + "|";
}

}  // namespace

std::string byte_picture(const Layout& layout) {
  std::vector<Part> parts;
  add_fields(layout.fields, 0, parts);
  if (layout.checksum) {
    parts.push_back({layout.checksum->field.at, layout.checksum->field.end(), "checksum"});
  }
  std::size_t bytes = layout.bytes;
  if (layout.each) {
    add_fields(layout.each->fields, layout.each->at, parts);
    const std::size_t one = layout.each->at + layout.each->stride;
    if (layout.bytes == 0) {
      bytes = one;
    } else if (layout.each->most > 1) {
      parts.push_back({one, layout.each->at + layout.each->stride * layout.each->most,
                       fmt::format("{} more of {} bytes", layout.each->most - 1, layout.each->stride)});
    }
  }
  std::string text = "        ";
  for (std::size_t k = 0; k < std::min(bytes, row_bytes); ++k) {
    text += fmt::format(" {:^{}}", fmt::format("+{}", k), cell - 1);
  }
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
  std::string before;
  bool told = false;
  for (std::size_t at = 0; at < bytes; at += row_bytes) {
    const std::string line = row(parts, at, std::min(at + row_bytes, bytes));
    const bool blank = line.find_first_not_of("| ") == std::string::npos;
    if (blank && line == before) {
      text += told ? "" : "     ...\n";
      told = true;
      continue;
    }
    text += fmt::format("{:>6}  {}\n", at, line);
    before = line;
    told = false;
  }
  return text;
}

}  // namespace selfcal::profile
