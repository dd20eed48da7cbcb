// A table of a profile read strictly: each fault is a line "FILE:LINE: key: what", and reading goes on after it.
#pragma once

#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/toml_file/toml_text.hpp"

namespace selfcal::profile {

class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}
  void add(std::size_t line, std::string_view key, std::string_view what);
  bool none() const { return lines_.empty(); }
  std::string text() const;  // in the order of the lines
  std::size_t count() const { return lines_.size(); }
  const std::string& file() const { return file_; }

 private:
  std::string file_;
  std::vector<std::pair<std::size_t, std::string>> lines_;
};

class Section {
 public:
  // `table` may be null: every key is then absent, and needed ones are told at `line`.
  Section(Faults& faults, const toml::table* table, std::string path, std::size_t line)
      : faults_(&faults), table_(table), path_(std::move(path)), line_(line) {}

  bool there() const { return table_ != nullptr; }
  bool has(std::string_view key) const { return table_ != nullptr && table_->contains(key); }
  bool has_table(std::string_view key) const { return has(key) && table_->get(key)->is_table(); }
  std::size_t line() const { return line_; }
  std::size_t line_of(std::string_view key) const;
  const std::string& path() const { return path_; }
  std::string path_of(std::string_view key) const;

  std::optional<std::uint64_t> whole(std::string_view key, std::uint64_t low, std::uint64_t high, bool needed = false);
  std::optional<double> number(std::string_view key, double low, double high, bool needed = false);
  std::optional<std::string> text(std::string_view key, bool needed = false);
  // One of `known`.
  std::optional<std::string> word(std::string_view key, std::span<const std::string_view> known, bool needed = false);
  std::optional<bool> flag(std::string_view key);
  std::optional<std::vector<std::string>> texts(std::string_view key, std::size_t count);
  // A table below; of one that is absent a section that is not there, told if needed.
  Section table(std::string_view key, bool needed = false);
  std::vector<std::string> keys() const;

  void fault(std::string_view key, std::string_view what) { faults_->add(line_of(key), path_of(key), what); }
  void missing(std::string_view key) { faults_->add(line_, path_of(key), "missing"); }
  // After everything was asked for: other keys are faults.
  void only_these();
  Faults& faults() { return *faults_; }

 private:
  const toml::node* get(std::string_view key, bool needed);

  Faults* faults_;
  const toml::table* table_;
  std::string path_;
  std::size_t line_;
  std::set<std::string, std::less<>> asked_;
};

}  // namespace selfcal::profile
