#include "daemon/store/page_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace selfcal {

Expected<PageFile> PageFile::open(const std::filesystem::path& path, const PageLayout& layout) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  if (fd < 0) {
    return fail(ErrorKind::device, fmt::format("{}: {}", path.string(), std::strerror(errno)));
  }
  PageFile file(fd, layout, path.string());
  flash::PageBytes bytes;
  for (std::uint32_t page = 0;; ++page) {
    const auto got = pread(fd, bytes.data(), bytes.size(), static_cast<off_t>(page) * flash::page_bytes);
    if (got <= 0) {
      break;
    }
    if (got == static_cast<ssize_t>(bytes.size()) && file.complaint(page, bytes).empty()) {
      file.mark(page);
    }
  }
  return file;
}

PageFile::PageFile(PageFile&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      layout_(other.layout_),
      name_(std::move(other.name_)),
      have_(std::move(other.have_)),
      count_(other.count_),
      full_below_(other.full_below_),
      scratch_(std::move(other.scratch_)) {}

PageFile& PageFile::operator=(PageFile&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(layout_, other.layout_);
  std::swap(name_, other.name_);
  std::swap(have_, other.have_);
  std::swap(count_, other.count_);
  std::swap(full_below_, other.full_below_);
  std::swap(scratch_, other.scratch_);
  return *this;
}

PageFile::~PageFile() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

std::string PageFile::complaint(std::uint32_t page, std::span<const std::uint8_t> bytes) {
  if (const auto decoded = flash::decode_page(bytes, scratch_); !decoded) {
    return decoded.error() == flash::PageError::bad_crc ? "wrong CRC" : std::string(flash::name(decoded.error()));
  }
  if (scratch_.run_id != layout_.rotation) {
    return fmt::format("rotation {}, {} expected", scratch_.run_id, layout_.rotation);
  }
  if (scratch_.sequence != page) {
    return fmt::format("sequence number {}, {} expected", scratch_.sequence, page);
  }
  const std::uint64_t first = std::uint64_t{page} * layout_.samples_per_page;
  if (scratch_.first_sample != first) {
    return fmt::format("first sample {}, {} expected", scratch_.first_sample, first);
  }
  const std::uint64_t rest = layout_.samples > first ? layout_.samples - first : 0;
  const std::uint64_t count = std::min<std::uint64_t>(rest, layout_.samples_per_page);
  if (scratch_.samples.size() != count) {
    return fmt::format("{} samples, {} expected", scratch_.samples.size(), count);
  }
  return {};
}

void PageFile::mark(std::uint32_t page) {
  if (page >= have_.size()) {
    have_.resize(std::size_t{page} + 1, false);
  }
  if (!have_[page]) {
    ++count_;
  }
  have_[page] = true;
}

Expected<std::string> PageFile::store(std::uint32_t page, std::span<const std::uint8_t> bytes) {
  if (std::string wrong = complaint(page, bytes); !wrong.empty()) {
    return wrong;
  }
  const auto written = pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(page) * flash::page_bytes);
  if (written != static_cast<ssize_t>(bytes.size())) {
    return fail(ErrorKind::device,
                fmt::format("{}: page {}: {}", name_, page, written < 0 ? std::strerror(errno) : "no space left"));
  }
  mark(page);
  return std::string();
}

Expected<void> PageFile::reserve(std::uint64_t bytes) {
  if (fallocate(fd_, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(bytes)) == 0 || errno == EOPNOTSUPP) {
    return {};
  }
  return fail(ErrorKind::device,
              fmt::format("{}: {} bytes cannot be set aside: {}", name_, bytes, std::strerror(errno)));
}

PageFile::Range PageFile::missing(std::uint32_t end, std::uint32_t longest) {
  while (full_below_ < end && has(full_below_)) {
    ++full_below_;
  }
  Range range{full_below_, 0};
  while (range.count < longest && range.first + range.count < end && !has(range.first + range.count)) {
    ++range.count;
  }
  return range;
}

}  // namespace selfcal
