#include "protocol/profile/profile_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/toml_file/nearest_word.hpp"

namespace selfcal::profile {

void Faults::add(std::size_t line, std::string_view key, std::string_view what) {
  lines_.emplace_back(line, fmt::format("{}:{}: {}: {}", file_, line, one_line(key), one_line(what)));
}

std::string Faults::text() const {
  auto sorted = lines_;
  std::ranges::stable_sort(sorted, {}, [](const auto& fault) { return fault.first; });
  std::string text;
  for (const auto& [line, words] : sorted) {
    text += (text.empty() ? "" : "\n") + words;
  }
  return text;
}

std::size_t Section::line_of(std::string_view key) const {
  if (table_ != nullptr) {
    for (const auto& [name, node] : *table_) {
      if (name.str() == key) {
        return name.source().begin.line;
      }
    }
  }
  return line_;
}

std::string Section::path_of(std::string_view key) const {
  return path_.empty() ? std::string(key) : key.empty() ? path_ : path_ + "." + std::string(key);
}

const toml::node* Section::get(std::string_view key, bool needed) {
  asked_.emplace(key);
  const toml::node* node = table_ == nullptr ? nullptr : table_->get(key);
  if (node == nullptr && needed) {
    missing(key);
  }
  return node;
}

std::optional<std::uint64_t> Section::whole(std::string_view key, std::uint64_t low, std::uint64_t high, bool needed) {
  const toml::node* node = get(key, needed);
  if (node == nullptr) {
    return std::nullopt;
  }
  const auto value = node->value_exact<std::int64_t>();
  if (!value) {
    fault(key, "must be a whole number");
    return std::nullopt;
  }
  if (*value < 0 || static_cast<std::uint64_t>(*value) < low || static_cast<std::uint64_t>(*value) > high) {
    fault(key, fmt::format("is {0} (0x{0:X}), must lie between {1} (0x{1:X}) and {2} (0x{2:X})", *value, low, high));
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(*value);
}

std::optional<double> Section::number(std::string_view key, double low, double high, bool needed) {
  const toml::node* node = get(key, needed);
  if (node == nullptr) {
    return std::nullopt;
  }
  const auto value = node->is_number() ? node->value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) {
    fault(key, "must be a finite number");
    return std::nullopt;
  }
  if (!(*value >= low && *value <= high)) {
    fault(key, fmt::format("is {}, must lie between {:g} and {:g}", *value, low, high));
    return std::nullopt;
  }
  return value;
}

std::optional<std::string> Section::text(std::string_view key, bool needed) {
  const toml::node* node = get(key, needed);
  if (node == nullptr) {
    return std::nullopt;
  }
  const auto value = node->value_exact<std::string>();
  if (!value || value->empty()) {
    fault(key, "must be a string that is not empty");
    return std::nullopt;
  }
  return value;
}

std::optional<std::string> Section::word(std::string_view key, std::span<const std::string_view> known, bool needed) {
  const auto value = text(key, needed);
  if (value && std::ranges::find(known, *value) == known.end()) {
    fault(key,
          fmt::format("no such word: {}{}; known are {}", *value, did_you_mean(*value, known), fmt::join(known, ", ")));
    return std::nullopt;
  }
  return value;
}

std::optional<bool> Section::flag(std::string_view key) {
  const toml::node* node = get(key, false);
  if (node == nullptr) {
    return std::nullopt;
  }
  const auto value = node->value_exact<bool>();
  if (!value) {
    fault(key, "must be true or false");
  }
  return value;
}

std::optional<std::vector<std::string>> Section::texts(std::string_view key, std::size_t count) {
  const toml::node* node = get(key, false);
  if (node == nullptr) {
    return std::nullopt;
  }
  std::vector<std::string> words;
  if (const toml::array* array = node->as_array()) {
    for (const toml::node& element : *array) {
      if (const auto word = element.value_exact<std::string>()) {
        words.push_back(*word);
      }
    }
    if (array->size() == count && words.size() == count) {
      return words;
    }
  }
  fault(key, fmt::format("must be an array of {} strings", count));
  return std::nullopt;
}

Section Section::table(std::string_view key, bool needed) {
  const toml::node* node = get(key, needed);
  if (node != nullptr && !node->is_table()) {
    fault(key, "must be a table");
    node = nullptr;
  }
  return {*faults_, node == nullptr ? nullptr : node->as_table(), path_of(key), line_of(key)};
}

std::vector<std::string> Section::keys() const {
  std::vector<std::string> names;
  if (table_ != nullptr) {
    for (const auto& [name, node] : *table_) {
      names.emplace_back(name.str());
    }
  }
  return names;
}

void Section::only_these() {
  for (const std::string& key : keys()) {
    if (!asked_.contains(key)) {
      const std::vector<std::string> known(asked_.begin(), asked_.end());
      fault(key,
            fmt::format("no such key{}; known are {}", did_you_mean(key, std::span(known)), fmt::join(known, ", ")));
    }
  }
}

}  // namespace selfcal::profile
