// Strict reading of nested TOML tables: each key is asked for by name and type, and what nobody asked for is an error.
#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/toml_file/toml_text.hpp"

namespace selfcal::sim {

// The whole file as text; bad_input naming it where it cannot be read.
[[nodiscard]] Expected<std::string> read_text(const std::string& path);

// One table of a file. The first problem is kept; the calls after it do nothing. Ask finish() at the end.
class TomlTable {
 public:
  TomlTable(const toml::table& table, std::string file, std::string prefix = {});

  // Each leaves `value` as it is where the key is absent. Out of [low, high], of another type, not finite: a problem.
  void number(std::string_view key, double& value, double low, double high);
  void integer(std::string_view key, std::uint64_t& value, std::uint64_t low, std::uint64_t high);
  void text(std::string_view key, std::string& value);
  void numbers(std::string_view key, std::vector<double>& values, double low, double high);
  // One number stands for `count` of them.
  void number_or_numbers(std::string_view key, std::vector<double>& values, std::size_t count, double low, double high);
  void boolean(std::string_view key, bool& value);
  // Calls `read` with the sub-table, or with each table of the array of tables, where the key is present.
  void table(std::string_view key, const std::function<void(TomlTable&)>& read);
  void tables(std::string_view key, const std::function<void(TomlTable&)>& read);

  bool has(std::string_view key) const { return table_.contains(key); }
  // The keys of this table are none of the caller's business.
  void ignore();
  // A problem of the caller's own with a key's value.
  void refuse(std::string_view key, const std::string& what);
  bool sound() const { return !problem_; }
  // The first problem, or the first key that was not asked for.
  [[nodiscard]] Expected<void> finish();

 private:
  const toml::node* asked(std::string_view key);

  const toml::table& table_;
  std::string file_;
  std::string prefix_;
  std::set<std::string, std::less<>> known_;
  std::optional<Error> problem_;
};

// Parses, hands the root to `read`, and reports the first problem.
[[nodiscard]] Expected<void> read_toml(const std::string& text, const std::string& name,
                                       const std::function<void(TomlTable&)>& read);

}  // namespace selfcal::sim
