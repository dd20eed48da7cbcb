// The raw pages of one rotation, in a file of the run's folder: what is there survives a restart of the daemon, and
// what is damaged is known by its CRC and fetched again.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/flash/page.hpp"

namespace selfcal {

// What every page of a rotation must agree with: every page but the last is full, so that page p begins with sample
// p * samples_per_page, no two pages overlap and none leaves a hole.
struct PageLayout {
  std::uint32_t rotation = 0;
  std::uint32_t samples_per_page = 0;
  std::uint64_t samples = 0;  // of the rotation so far, by the directory
};

class PageFile {
 public:
  // Pages that the file holds already are kept where they agree with `layout`.
  static Expected<PageFile> open(const std::filesystem::path& file, const PageLayout& layout);
  PageFile(PageFile&& other) noexcept;
  PageFile& operator=(PageFile&& other) noexcept;
  ~PageFile();

  // The directory was read again: so many samples of the rotation are in its pages now.
  void learn_samples(std::uint64_t samples) { layout_.samples = samples; }

  // Empty: stored. Else what is wrong with the page ("wrong CRC", "144 samples, 145 expected").
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
  PageFile(int fd, const PageLayout& layout, std::string name) : fd_(fd), layout_(layout), name_(std::move(name)) {}
  std::string complaint(std::uint32_t page, std::span<const std::uint8_t> bytes);
  void mark(std::uint32_t page);

  int fd_;
  PageLayout layout_;
  std::string name_;
  std::vector<bool> have_;
  std::uint32_t count_ = 0;
  std::uint32_t full_below_ = 0;  // nothing is missing below this
  flash::Page scratch_;
};

}  // namespace selfcal
