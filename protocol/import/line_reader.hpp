// The lines of a text file of any size, plain or gzip, one at a time: memory for one block and one line.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal::import {

class LineReader {
 public:
  static Expected<LineReader> open(const std::filesystem::path& path);
  LineReader(LineReader&&) noexcept;
  LineReader& operator=(LineReader&&) noexcept;
  ~LineReader();

  // The next line without its end and, in the first, without a byte order mark; false at the end of the file. LINE
  // lives until the next call. An error (bad_input) where the file cannot be read, is damaged, holds a NUL with anything but NULs
  // behind it, or a line is longer than 1 MiB.
  Expected<bool> next(std::string_view& line);
  std::size_t number() const { return number_; }  // of the line that next() gave, counted from 1

 private:
  struct Input;
  LineReader(std::unique_ptr<Input> input, std::string name);
  Expected<bool> refill();
  bool only_zeros_behind(std::size_t first);

  std::unique_ptr<Input> input_;
  std::string name_;
  std::string buffer_;
  std::size_t at_ = 0;
  std::size_t number_ = 0;
  bool ended_ = false;
};

}  // namespace selfcal::import
