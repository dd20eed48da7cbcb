// A flat TOML table read strictly: every error names file, line and key; unknown keys are errors.
#pragma once

#include <array>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal {

class TomlFile {
 public:
  // `name` is what messages call the text.
  static Expected<TomlFile> parse(std::string_view text, std::string name);

  TomlFile(TomlFile&&) noexcept;
  TomlFile& operator=(TomlFile&&) noexcept;
  ~TomlFile();

  bool has(std::string_view key) const;
  // An error (bad_input) for the first key that is not among `known`.
  Expected<void> only(std::initializer_list<std::string_view> known) const;

  // Integer or floating point; finite.
  Expected<double> number(std::string_view key) const;
  Expected<std::string> text(std::string_view key) const;
  // nullopt where the key is absent.
  Expected<std::optional<double>> optional_number(std::string_view key) const;
  Expected<std::optional<std::string>> optional_text(std::string_view key) const;
  // [a, b, ...]
  Expected<std::vector<double>> numbers(std::string_view key) const;
  // [[a, b], ...]
  Expected<std::vector<std::array<double, 2>>> pairs(std::string_view key) const;
  bool is_array(std::string_view key) const;

  // "file:line: key: what", for checks of the caller's own.
  Error error_at(std::string_view key, std::string_view what) const;

 private:
  struct Document;
  explicit TomlFile(std::unique_ptr<Document> document);
  std::unique_ptr<Document> document_;
};

}  // namespace selfcal
