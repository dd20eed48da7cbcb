// The raw pages of one rotation, in a file of the run's folder: what is there survives a restart of the daemon, and
// what is damaged is known by its CRC and fetched again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/flash/page.hpp"

namespace selfcal {

class PageFile {
 public:
  // Pages of `rotation` that the file holds already are kept.
  static Expected<PageFile> open(const std::filesystem::path& file, std::uint32_t rotation);
  PageFile(PageFile&& other) noexcept;
  PageFile& operator=(PageFile&& other) noexcept;
  ~PageFile();

  // Empty: stored. Else why the page is no good ("bad CRC").
  Expected<std::string> store(std::uint32_t page, std::span<const std::uint8_t> bytes);

  // Sets disk space aside for the pages and, behind them, for the recording to be made of them; the file does not
  // grow. Where the file system cannot do that, nothing is set aside.
  Expected<void> reserve(std::uint64_t bytes);

  bool has(std::uint32_t page) const { return page < have_.size() && have_[page]; }
  std::uint32_t count() const { return count_; }
  // The first range of missing pages below `end`, at most `longest` long; count 0: none is missing.
  struct Range {
    std::uint32_t first = 0, count = 0;
  };
  Range missing(std::uint32_t end, std::uint32_t longest);

 private:
  PageFile(int fd, std::uint32_t rotation, std::string name) : fd_(fd), rotation_(rotation), name_(std::move(name)) {}
  std::string complaint(std::uint32_t page, std::span<const std::uint8_t> bytes);
  void mark(std::uint32_t page);

  int fd_;
  std::uint32_t rotation_;
  std::string name_;
  std::vector<bool> have_;
  std::uint32_t count_ = 0;
  std::uint32_t full_below_ = 0;  // nothing is missing below this
  flash::Page scratch_;
};

}  // namespace selfcal
