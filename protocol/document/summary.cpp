#include "protocol/document/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

namespace selfcal {
namespace {

constexpr const char* red = "31";
constexpr const char* green = "32";
constexpr const char* yellow = "33";

// Breaks at spaces; a word that is longer than the line keeps a line of its own.
std::vector<std::string> broken(const std::string& text, int columns) {
  std::vector<std::string> lines;
  std::string line;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, end - at);
    at = end + 1;
    if (!line.empty() && columns > 0 && static_cast<int>(line.size() + 1 + word.size()) > columns) {
      lines.push_back(line);
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  lines.push_back(line);
  return lines;
}

std::string paragraph(const char* head, const std::string& text, const char* shade, int columns, int most_lines) {
  constexpr int indent = 9;
  constexpr int narrowest = 16;
  if (text.empty()) {
    return {};
  }
  std::vector<std::string> lines = broken(text, columns > 0 ? std::max(narrowest, columns - indent) : 0);
  if (most_lines > 0 && static_cast<int>(lines.size()) > most_lines) {
    lines.resize(static_cast<std::size_t>(most_lines));
    std::string& last = lines.back();
    const auto room = static_cast<std::size_t>(std::max(narrowest, columns - indent) - 4);
    last = last.substr(0, last.size() > room ? last.rfind(' ', room) : last.size()) + " ...";
  }
  std::string out;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string shown = shade == nullptr ? lines[i] : fmt::format("\033[{}m{}\033[0m", shade, lines[i]);
    out += fmt::format("{:<{}}{}\n", i == 0 ? head : "", indent, shown);
  }
  return out;
}

}  // namespace

std::string_view name(SummaryStanding standing) {
  switch (standing) {
    case SummaryStanding::good: return "good";
    case SummaryStanding::bad: return "bad";
    case SummaryStanding::open: break;
  }
  return "open";
}

nlohmann::ordered_json summary_json(const Summary& summary) {
  return {{"standing", name(summary.standing)},
          {"verdict", summary.verdict},
          {"cause", summary.cause},
          {"next", summary.next}};
}

Summary read_summary(const nlohmann::ordered_json& json) {
  const auto text = [&](const char* key) {
    const auto found = json.find(key);
    return found == json.end() || !found->is_string() ? std::string() : found->get<std::string>();
  };
  Summary summary{SummaryStanding::open, text("verdict"), text("cause"), text("next")};
  for (const SummaryStanding standing : {SummaryStanding::good, SummaryStanding::bad}) {
    if (text("standing") == name(standing)) {
      summary.standing = standing;
    }
  }
  return summary;
}

std::string summary_text(const Summary& summary, bool colour, int columns, int most_lines) {
  const char* shade = !colour                                     ? nullptr
                      : summary.standing == SummaryStanding::good ? green
                      : summary.standing == SummaryStanding::bad  ? red
                                                                  : yellow;
  return paragraph("verdict", summary.verdict, shade, columns, most_lines) +
         paragraph("cause", summary.cause, nullptr, columns, most_lines) +
         paragraph("next", summary.next, nullptr, columns, 0);  // a command is of use only whole
}

}  // namespace selfcal
