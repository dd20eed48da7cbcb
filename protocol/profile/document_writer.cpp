#include "protocol/profile/document_writer.hpp"

#include <fmt/format.h>

namespace selfcal::profile {
namespace {

std::string html_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return out;
}

}  // namespace

Writer::Writer(Markup markup, std::string_view title) : html_(markup == Markup::html) {
  if (html_) {
    text_ = fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>\n"
        "body{{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}}\n"
        "table{{border-collapse:collapse}}td,th{{border:1px solid #999;padding:.2em .6em;text-align:left}}\n"
        "pre{{overflow-x:auto;background:#f4f4f4;padding:.6em}}\n</style></head><body>\n<h1>{0}</h1>\n",
        html_text(title));
  } else {
    text_ = fmt::format("# {}\n\n", title);
  }
}

void Writer::heading(std::string_view words) {
  text_ += html_ ? fmt::format("<h2>{}</h2>\n", html_text(words)) : fmt::format("## {}\n\n", words);
}

void Writer::say(std::string_view words) {
  text_ += html_ ? fmt::format("<p>{}</p>\n", html_text(words)) : fmt::format("{}\n\n", words);
}

void Writer::table(const Row& head, const std::vector<Row>& rows) {
  const auto line = [&](const Row& cells, std::string_view tag) {
    if (!html_) {
      return fmt::format("| {} |\n", fmt::join(cells, " | "));
    }
    std::string out = "<tr>";
    for (const std::string& text : cells) {
      out += fmt::format("<{0}>{1}</{0}>", tag, html_text(text));
    }
    return out + "</tr>\n";
  };
  text_ += html_ ? "<table>\n" : "";
  text_ += line(head, "th");
  if (!html_) {
    text_ += fmt::format("|{}\n", fmt::join(Row(head.size(), "---|"), ""));
  }
  for (const Row& row : rows) {
    text_ += line(row, "td");
  }
  text_ += html_ ? "</table>\n" : "\n";
}

void Writer::picture(std::string_view drawing) {
  text_ += html_ ? fmt::format("<pre>{}</pre>\n", html_text(drawing)) : fmt::format("```\n{}```\n\n", drawing);
}

std::string Writer::end() const { return html_ ? text_ + "</body></html>\n" : text_.substr(0, text_.size() - 1); }

}  // namespace selfcal::profile
