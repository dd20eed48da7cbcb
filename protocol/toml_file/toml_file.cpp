#include "protocol/toml_file/toml_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>
#include <utility>

#include "protocol/toml_file/nearest_word.hpp"
#include "protocol/toml_file/toml_text.hpp"

namespace selfcal {

struct TomlFile::Document {
  std::string name;
  toml::table table;
};

namespace {

// Arrays not by the library: its formatter (toml++ 3.3) guesses their width and converts a negative number to an unsigned one
// where an element is below 0.1. The parser lets arrays in arrays go no deeper than 256.
void write(const toml::node& node, std::ostream& out) {
  if (node.is_table()) {
    out << "{...}";
  } else if (const toml::array* array = node.as_array()) {
    const char* separator = "";
    out << '[';
    for (const toml::node& element : *array) {
      out << std::exchange(separator, ", ");
      write(element, out);
    }
    out << ']';
  } else {
    node.visit([&](const auto& value) {
      if constexpr (toml::is_value<decltype(value)>) {
        out << value;
      }
    });
  }
}

std::string written(const toml::node& node) {
  std::ostringstream out;
  write(node, out);
  const std::string text = one_line(out.str());
  constexpr std::size_t longest = 60;
  return text.size() > longest ? text.substr(0, longest) + "..." : text;
}

Error error_of(const std::string& name, const toml::node* node, std::string_view key, std::string_view what) {
  if (node == nullptr) {
    return {ErrorKind::bad_input, fmt::format("{}: {}: {}", name, one_line(key), one_line(what))};
  }
  return {ErrorKind::bad_input,
          fmt::format("{}:{}: {}: {}", name, node->source().begin.line, one_line(key), one_line(what))};
}

Expected<double> number_of(const std::string& name, const toml::node& node, std::string_view key) {
  if (!node.is_number()) {
    return tl::unexpected(error_of(name, &node, key, fmt::format("{} is not a number", written(node))));
  }
  const double value = node.value<double>().value_or(std::nan(""));
  if (!std::isfinite(value)) {
    return tl::unexpected(error_of(name, &node, key, fmt::format("{} is not a finite number", written(node))));
  }
  return value;
}

}  // namespace

TomlFile::TomlFile(std::unique_ptr<Document> document) : document_(std::move(document)) {}
TomlFile::TomlFile(TomlFile&&) noexcept = default;
TomlFile& TomlFile::operator=(TomlFile&&) noexcept = default;
TomlFile::~TomlFile() = default;

Expected<TomlFile> TomlFile::parse(std::string_view text, std::string name) {
  auto table = parse_toml(text, name);
  if (!table) {
    return tl::unexpected(table.error());
  }
  return TomlFile(std::make_unique<Document>(Document{std::move(name), std::move(*table)}));
}

bool TomlFile::has(std::string_view key) const { return document_->table.contains(key); }

bool TomlFile::is_array(std::string_view key) const {
  const toml::node* node = document_->table.get(key);
  return node != nullptr && node->is_array();
}

Expected<void> TomlFile::only(std::initializer_list<std::string_view> known) const {
  for (const auto& [key, node] : document_->table) {
    if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
      return tl::unexpected(error_of(
          document_->name, &node, key.str(),
          fmt::format("no such key{}; known are {}", did_you_mean(key.str(), std::span(known.begin(), known.size())),
                      fmt::join(known, ", "))));
    }
  }
  return {};
}

Error TomlFile::error_at(std::string_view key, std::string_view what) const {
  return error_of(document_->name, document_->table.get(key), key, what);
}

Expected<double> TomlFile::number(std::string_view key) const {
  const toml::node* node = document_->table.get(key);
  if (node == nullptr) {
    return tl::unexpected(error_at(key, "missing"));
  }
  return number_of(document_->name, *node, key);
}

Expected<std::string> TomlFile::text(std::string_view key) const {
  const toml::node* node = document_->table.get(key);
  if (node == nullptr) {
    return tl::unexpected(error_at(key, "missing"));
  }
  if (const auto value = node->value_exact<std::string>()) {
    return *value;
  }
  return tl::unexpected(error_at(key, fmt::format("{} is not a string", written(*node))));
}

Expected<std::optional<double>> TomlFile::optional_number(std::string_view key) const {
  if (!has(key)) {
    return std::optional<double>{};
  }
  return number(key).map([](double value) { return std::optional<double>{value}; });
}

Expected<std::optional<std::string>> TomlFile::optional_text(std::string_view key) const {
  if (!has(key)) {
    return std::optional<std::string>{};
  }
  return text(key).map([](std::string value) { return std::optional<std::string>{std::move(value)}; });
}

Expected<std::vector<double>> TomlFile::numbers(std::string_view key) const {
  const toml::node* node = document_->table.get(key);
  if (node == nullptr) {
    return tl::unexpected(error_at(key, "missing"));
  }
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    return tl::unexpected(error_at(key, fmt::format("{} is not an array", written(*node))));
  }
  std::vector<double> values;
  for (const toml::node& element : *array) {
    const Expected<double> value = number_of(document_->name, element, fmt::format("{}[{}]", key, values.size()));
    if (!value) {
      return tl::unexpected(value.error());
    }
    values.push_back(*value);
  }
  return values;
}

Expected<std::vector<std::array<double, 2>>> TomlFile::pairs(std::string_view key) const {
  const toml::node* node = document_->table.get(key);
  if (node == nullptr) {
    return tl::unexpected(error_at(key, "missing"));
  }
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    return tl::unexpected(error_at(key, fmt::format("{} is not an array", written(*node))));
  }
  std::vector<std::array<double, 2>> values;
  for (const toml::node& element : *array) {
    const std::string place = fmt::format("{}[{}]", key, values.size());
    const toml::array* pair = element.as_array();
    if (pair == nullptr || pair->size() != 2) {
      return tl::unexpected(
          error_of(document_->name, &element, place, fmt::format("{} is not a pair of numbers", written(element))));
    }
    std::array<double, 2> both{};
    for (std::size_t k = 0; k < 2; ++k) {
      const Expected<double> value = number_of(document_->name, *pair->get(k), place);
      if (!value) {
        return tl::unexpected(value.error());
      }
      both[k] = *value;
    }
    values.push_back(both);
  }
  return values;
}

}  // namespace selfcal
