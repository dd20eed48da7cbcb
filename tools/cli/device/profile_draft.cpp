#include "tools/cli/device/profile_draft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

namespace selfcal::cli::device {
namespace {

std::size_t there(std::size_t at) {
  if (at == std::string::npos) {
    std::abort();
  }
  return at;
}

std::string header(std::string_view table) { return fmt::format("\n[{}]", table); }

}  // namespace

ProfileDraft::Part ProfileDraft::part(std::string_view table) const {
  const std::size_t head = table.empty() ? 0 : there(text_.find(header(table)));
  const std::size_t begin = table.empty() ? 0 : text_.find('\n', head + 1) + 1;
  const std::size_t next = text_.find("\n[", begin);
  return {begin, next == std::string::npos ? text_.size() : next};
}

ProfileDraft::Part ProfileDraft::line(std::string_view table, std::string_view key) const {
  const Part whole = part(table);
  const std::string begins = fmt::format("{} = ", key);
  std::size_t at = whole.begin;
  while (at < whole.end && text_.compare(at, begins.size(), begins) != 0) {
    at = there(text_.find('\n', at)) + 1;
  }
  return {at < whole.end ? at : there(std::string::npos), text_.find('\n', at) + 1};
}

void ProfileDraft::set_line(std::string_view table, std::string_view key, std::string_view value,
                            std::string_view new_key) {
  const Part at = line(table, key);
  text_.replace(at.begin, at.end - at.begin, fmt::format("{} = {}\n", new_key.empty() ? key : new_key, value));
}

void ProfileDraft::erase_line(std::string_view table, std::string_view key) {
  const Part at = line(table, key);
  text_.erase(at.begin, at.end - at.begin);
}

void ProfileDraft::add_line(std::string_view table, std::string_view words) {
  text_.insert(part(table).end, fmt::format("{}\n", words));
}

void ProfileDraft::set_table(std::string_view table, std::string_view lines) {
  const Part at = part(table);
  text_.replace(at.begin, at.end - at.begin, lines);
}

void ProfileDraft::erase_table(std::string_view table) {
  const std::size_t begin = there(text_.find(header(table)));
  text_.erase(begin, part(table).end - begin);
}

void ProfileDraft::insert_before(std::string_view table, std::string_view words) {
  text_.insert(there(text_.find(header(table))) + 1, words);
}

void ProfileDraft::set_head(std::string_view words) { text_.replace(0, there(text_.find("name = ")), words); }

}  // namespace selfcal::cli::device
