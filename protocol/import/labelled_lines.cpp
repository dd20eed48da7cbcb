#include "protocol/import/labelled_lines.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "protocol/import/guess_names.hpp"
#include "protocol/import/text_dialect.hpp"

namespace selfcal::import {
namespace {

constexpr std::string_view blanks = " \t\r";
constexpr std::string_view ends_of_word = " \t\r,;|:={}[]()<>\"'";
constexpr std::string_view ends_of_value = " \t\r,;|={}[]()\"'";

bool begins_number(std::string_view text) {
  const std::size_t sign = text.starts_with('-') || text.starts_with('+') ? 1 : 0;
  const std::size_t point = text.substr(sign).starts_with('.') ? 1 : 0;
  const std::string_view rest = text.substr(sign + point);
  return !rest.empty() && rest.front() >= '0' && rest.front() <= '9';
}

bool is_axis(std::string_view label) {
  return label.size() == 1 && std::string_view("xyzXYZ").find(label.front()) != std::string_view::npos;
}

class Reader {
 public:
  Reader(std::string_view line, bool words) : rest_(line), words_(words) {}

  LabelledLine read() {
    for (skip(); !rest_.empty(); skip()) {
      const char c = rest_.front();
      if (c == '{') {
        prefixes_.push_back(empty_ ? label_ : std::string());
        label_.clear();
        drop(1);
      } else if (c == '}') {
        if (!prefixes_.empty()) {
          prefixes_.pop_back();
        }
        label_.clear();
        drop(1);
      } else if (c == '"' || c == '\'') {
        take_quoted(c);
      } else if (begins_number(rest_)) {
        take_number();
      } else if (ends_of_word.find(c) != std::string_view::npos) {
        drop(1);
      } else {
        take_words();
      }
    }
    name_all();
    return std::move(line_);
  }

 private:
  void drop(std::size_t count) { rest_.remove_prefix(std::min(count, rest_.size())); }
  void skip() {
    while (!rest_.empty() && (blanks.find(rest_.front()) != std::string_view::npos || rest_.front() == ',' ||
                              rest_.front() == ';' || rest_.front() == '|')) {
      apart_ = apart_ || blanks.find(rest_.front()) == std::string_view::npos;
      drop(1);
    }
  }
  // Whether the next thing makes what stands before it a label; takes it.
  bool marks() {
    std::string_view ahead = rest_;
    while (!ahead.empty() && blanks.find(ahead.front()) != std::string_view::npos) {
      ahead.remove_prefix(1);
    }
    if (!ahead.starts_with(':') && !ahead.starts_with('=')) {
      return false;
    }
    equals_ = ahead.front() == '=';
    rest_ = ahead.substr(1);
    return true;
  }
  void begin_label(std::string_view words, bool marked) {
    // One label in front of another stands before all that follow it.
    if (empty_ && !label_.empty() && prefixes_.empty()) {
      before_ = label_;
    }
    label_ = std::string(words);
    if (is_axis(words)) {
      if (!before_.empty()) {
        label_ = fmt::format("{}.{}", before_, label_);
      } else if (!stem_.empty()) {
        label_ = fmt::format("{}{}", stem_, label_);
      }
    } else {
      before_ = empty_ && !before_.empty() ? before_ : std::string();
      stem_ = is_axis(words.substr(words.size() - 1)) && words.size() > 1
                  ? std::string(words.substr(0, words.size() - 1))
                  : std::string();
    }
    for (auto prefix = prefixes_.rbegin(); prefix != prefixes_.rend(); ++prefix) {
      label_ = prefix->empty() ? label_ : fmt::format("{}.{}", *prefix, label_);
    }
    empty_ = true;
    count_ += marked || words_ ? 1 : 0;
  }
  void add(std::string_view value, std::string unit) {
    // "gz=0.1 1600000000": a blank ends what an equals sign gives.
    if (!empty_ && equals_ && !apart_) {
      label_.clear();
    }
    apart_ = false;
    line_.values.push_back(value);
    line_.names.push_back(label_);
    line_.units.push_back(std::move(unit));
    empty_ = false;
  }
  void take_quoted(char mark) {
    drop(1);
    const std::size_t end = std::min(rest_.find(mark), rest_.size());
    const std::string_view text = rest_.substr(0, end);
    drop(end + 1);
    if (marks()) {
      begin_label(trimmed(text), true);
    } else if (!label_.empty()) {
      line_.numbers += number_of(text, '.') ? 1 : 0;  // t="0.01"
      add(text, {});
    }
  }
  void take_number() {
    const std::string_view text = rest_.substr(0, std::min(rest_.find_first_of(ends_of_value), rest_.size()));
    drop(text.size());
    std::size_t length = text.size();
    const bool whole = number_of(text, '.') || date_of(text);
    while (!whole && length > 0 && !number_of(text.substr(0, length), '.')) {
      --length;
    }
    std::string unit = known_unit(text.substr(length));  // "0.98g"
    const bool cut = length > 0 && (length == text.size() || !unit.empty());
    line_.numbers += cut ? 1 : 0;
    add(cut ? text.substr(0, length) : text, cut ? std::move(unit) : std::string());
  }
  // Words up to a number, a mark or a separator: a label, behind a number its unit before that.
  void take_words() {
    std::vector<std::string_view> all;
    const char* begin = rest_.data();
    const char* end = begin;
    for (;;) {
      const std::string_view word = rest_.substr(0, std::min(rest_.find_first_of(ends_of_word), rest_.size()));
      if (word.empty() || (!all.empty() && begins_number(word))) {
        break;
      }
      all.push_back(word);
      drop(word.size());
      end = rest_.data();
      while (!rest_.empty() && blanks.find(rest_.front()) != std::string_view::npos) {
        drop(1);
      }
    }
    const bool unit = !empty_ && !line_.units.empty() && line_.units.back().empty() && !known_unit(all.front()).empty();
    const bool marked = marks();
    if (unit && (all.size() > 1 || !marked)) {
      line_.units.back() = known_unit(all.front());
      all.erase(all.begin());
    }
    if (all.empty()) {
      return;
    }
    const std::string_view words(all.front().data(), static_cast<std::size_t>(end - all.front().data()));
    if (marked || (words_ && begins_number(rest_))) {
      begin_label(words, marked);
    } else if (!label_.empty() && empty_) {
      add(words, {});  // null, true, a name
    }
  }
  // "acc", "acc", "acc" are its 0, 1 and 2.
  void name_all() {
    std::map<std::string, std::size_t> times, at;
    for (const std::string& name : line_.names) {
      ++times[name];
    }
    for (std::string& name : line_.names) {
      if (!name.empty() && times[name] > 1) {
        const std::size_t index = at[name]++;
        name += fmt::format("[{}]", index);
      }
    }
    constexpr std::size_t least = 2;
    line_.labelled = count_ >= least && line_.numbers >= least;
  }

  std::string_view rest_;
  bool words_;
  LabelledLine line_;
  std::vector<std::string> prefixes_;
  std::string label_, before_, stem_;
  bool empty_ = false;   // the label has no value yet
  bool equals_ = false;  // its mark
  bool apart_ = false;   // more than blanks since the last value
  std::size_t count_ = 0;
};

}  // namespace

LabelledLine read_labels(std::string_view line, bool words) { return Reader(line, words).read(); }

std::optional<Labels> detect_labels(const std::vector<std::string_view>& lines, bool words) {
  struct Kind {
    LabelledLine first;
    std::size_t count = 0;
  };
  std::map<std::string, Kind> kinds;
  std::size_t all = 0;
  for (const std::string_view line : lines) {
    if (trimmed(line).empty()) {
      continue;
    }
    ++all;
    LabelledLine read = read_labels(line, words);
    if (!read.labelled) {
      continue;
    }
    Kind& kind = kinds[fmt::format("{}", fmt::join(read.names, ", "))];
    if (kind.count++ == 0) {
      kind.first = std::move(read);
    }
  }
  const auto fewer = [](const auto& a, const auto& b) { return a.second.count < b.second.count; };
  const auto most = std::max_element(kinds.begin(), kinds.end(), fewer);
  // Lines that say what they hold say it nearly all; a head with "name: value" is no table.
  constexpr std::size_t least = 20, one_in = 3, few = 5;
  if (most == kinds.end() || most->second.count < least || one_in * most->second.count < all ||
      (words && kinds.size() > 1)) {
    return std::nullopt;
  }
  Labels labels{most->second.first.names, most->second.first.units, words, {}};
  for (const auto& [names, kind] : kinds) {
    if (names != most->first && few * kind.count >= most->second.count) {
      labels.rival = names;
    }
  }
  return labels;
}

bool labelled_fields(std::string_view line, const Labels& labels, std::vector<std::string_view>& fields) {
  const LabelledLine read = read_labels(line, labels.words);
  if (read.names == labels.names) {
    fields = read.values;
    return true;
  }
  fields.assign(labels.names.size(), {});
  bool any = false;
  for (std::size_t k = 0; k < read.names.size(); ++k) {
    const auto at = std::find(labels.names.begin(), labels.names.end(), read.names[k]);
    if (at != labels.names.end() && !read.names[k].empty()) {
      fields[static_cast<std::size_t>(at - labels.names.begin())] = read.values[k];
      any = true;
    }
  }
  return any;
}

}  // namespace selfcal::import
