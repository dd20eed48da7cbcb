#include "sim_ins/toml_reader.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <span>
#include <vector>

#include "protocol/toml_file/nearest_word.hpp"

namespace selfcal::sim {

Expected<std::string> read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  if (!file) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot be read", path));
  }
  return text;
}

TomlTable::TomlTable(const toml::table& table, std::string file, std::string prefix)
    : table_(table), file_(std::move(file)), prefix_(std::move(prefix)) {}

const toml::node* TomlTable::asked(std::string_view key) {
  known_.emplace(key);
  return problem_ ? nullptr : table_.get(key);
}

void TomlTable::ignore() {
  for (const auto& [key, value] : table_) {
    known_.insert(std::string(key.str()));
  }
}

void TomlTable::refuse(std::string_view key, const std::string& what) {
  if (problem_) {
    return;
  }
  const toml::node* node = table_.get(key);
  const auto line = (node != nullptr ? node->source() : table_.source()).begin.line;
  problem_ =
      Error{ErrorKind::bad_input, fmt::format("{}:{}: {}{}: {}", file_, line, prefix_, one_line(key), one_line(what))};
}

void TomlTable::number(std::string_view key, double& value, double low, double high) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  const auto read = node->value<double>();
  if (!node->is_number() || !read) {
    refuse(key, "not a number");
  } else if (!std::isfinite(*read) || *read < low || *read > high) {
    refuse(key, fmt::format("{} is outside [{}, {}]", *read, low, high));
  } else {
    value = *read;
  }
}

void TomlTable::numbers(std::string_view key, std::vector<double>& values, double low, double high) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  if (!node->is_array()) {
    refuse(key, "not an array of numbers");
    return;
  }
  std::vector<double> read;
  for (const toml::node& element : *node->as_array()) {
    const auto value = element.value<double>();
    if (!element.is_number() || !value) {
      return refuse(key, "not an array of numbers");
    }
    if (!std::isfinite(*value) || *value < low || *value > high) {
      return refuse(key, fmt::format("{} is outside [{}, {}]", *value, low, high));
    }
    read.push_back(*value);
  }
  values = std::move(read);
}

void TomlTable::integer(std::string_view key, std::uint64_t& value, std::uint64_t low, std::uint64_t high) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  const auto read = node->value_exact<std::int64_t>();
  if (!read) {
    refuse(key, "not an integer");
  } else if (*read < 0 || static_cast<std::uint64_t>(*read) < low || static_cast<std::uint64_t>(*read) > high) {
    refuse(key, fmt::format("{} is outside [{}, {}]", *read, low, high));
  } else {
    value = static_cast<std::uint64_t>(*read);
  }
}

void TomlTable::text(std::string_view key, std::string& value) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  if (const auto read = node->value_exact<std::string>()) {
    value = *read;
  } else {
    refuse(key, "not a string");
  }
}

void TomlTable::number_or_numbers(std::string_view key, std::vector<double>& values, std::size_t count, double low,
                                  double high) {
  const toml::node* node = table_.get(key);
  if (node == nullptr || !node->is_number()) {
    return numbers(key, values, low, high);
  }
  double one = 0.0;
  number(key, one, low, high);
  values.assign(count, one);
}

void TomlTable::boolean(std::string_view key, bool& value) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  if (const auto read = node->value_exact<bool>()) {
    value = *read;
  } else {
    refuse(key, "neither true nor false");
  }
}

void TomlTable::table(std::string_view key, const std::function<void(TomlTable&)>& read) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  if (!node->is_table()) {
    refuse(key, "not a table");
    return;
  }
  TomlTable inner(*node->as_table(), file_, fmt::format("{}{}.", prefix_, key));
  read(inner);
  if (const auto done = inner.finish(); !done) {
    problem_ = done.error();
  }
}

void TomlTable::tables(std::string_view key, const std::function<void(TomlTable&)>& read) {
  const toml::node* node = asked(key);
  if (node == nullptr) {
    return;
  }
  if (!node->is_array_of_tables()) {
    refuse(key, "not an array of tables");
    return;
  }
  std::size_t index = 0;
  for (const toml::node& element : *node->as_array()) {
    TomlTable inner(*element.as_table(), file_, fmt::format("{}{}[{}].", prefix_, key, index++));
    read(inner);
    if (const auto done = inner.finish(); !done) {
      problem_ = done.error();
      return;
    }
  }
}

Expected<void> TomlTable::finish() {
  if (!problem_) {
    for (const auto& [key, node] : table_) {
      if (!known_.contains(key.str())) {
        const std::vector<std::string> known(known_.begin(), known_.end());
        refuse(key.str(), "no such key" + did_you_mean(key.str(), std::span<const std::string>(known)));
        break;
      }
    }
  }
  if (problem_) {
    return tl::unexpected(*problem_);
  }
  return {};
}

Expected<void> read_toml(const std::string& text, const std::string& name,
                         const std::function<void(TomlTable&)>& read) {
  const Expected<toml::table> table = parse_toml(text, name);
  if (!table) {
    return tl::unexpected(table.error());
  }
  TomlTable root(*table, name);
  read(root);
  return root.finish();
}

}  // namespace selfcal::sim
