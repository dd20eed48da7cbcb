#include "protocol/import/line_reader.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <cerrno>

namespace selfcal::import {
namespace {

constexpr std::size_t block = std::size_t{1} << 18;
constexpr std::size_t longest_line = std::size_t{1} << 20;

}  // namespace

struct LineReader::Input {
  explicit Input(const std::filesystem::path& path) : file(gzopen(path.c_str(), "rb")) {}
  ~Input() {
    if (file != nullptr) {
      gzclose(file);
    }
  }
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;
  gzFile file;
};

LineReader::LineReader(std::unique_ptr<Input> input, std::string name)
    : input_(std::move(input)), name_(std::move(name)) {}
LineReader::LineReader(LineReader&&) noexcept = default;
LineReader& LineReader::operator=(LineReader&&) noexcept = default;
LineReader::~LineReader() = default;

Expected<LineReader> LineReader::open(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return fail(ErrorKind::bad_input, fmt::format("{}: is a folder", path.string()));
  }
  errno = 0;
  auto input = std::make_unique<Input>(path);
  if (input->file == nullptr) {
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot open: {}", path.string(), std::strerror(errno)));
  }
  return LineReader(std::move(input), path.string());
}

Expected<bool> LineReader::refill() {
  buffer_.erase(0, at_);
  at_ = 0;
  const std::size_t held = buffer_.size();
  buffer_.resize(held + block);
  const int count = gzread(input_->file, buffer_.data() + held, static_cast<unsigned>(block));
  if (count < 0) {
    int code = 0;
    return fail(ErrorKind::bad_input,
                fmt::format("{}: line {}: damaged: {}", name_, number_ + 1, gzerror(input_->file, &code)));
  }
  buffer_.resize(held + static_cast<std::size_t>(count));
  if (const std::size_t first = buffer_.find('\0', held); first != std::string::npos) {
    const bool wide = buffer_.starts_with("\xFF\xFE") || buffer_.starts_with("\xFE\xFF");
    const bool begun = first > 0 || number_ > 0;  // a file of zeros alone is no text
    if (!wide && begun && only_zeros_behind(first)) {
      return true;
    }
    return fail(ErrorKind::bad_input,
                fmt::format("{}: line {}: {}", name_, number_ + 1,
                            wide ? "UTF-16; text in UTF-8 is expected (`iconv -f UTF-16 -t UTF-8` makes it)"
                                 : "holds a byte 0; a text is expected"));
  }
  return count > 0;
}

// A card's last block is filled up with zeros: where nothing else follows the text ends there.
bool LineReader::only_zeros_behind(std::size_t first) {
  if (buffer_.find_first_not_of('\0', first) != std::string::npos) {
    return false;
  }
  std::string rest(block, '\0');
  for (int count = 1; count > 0;) {
    count = gzread(input_->file, rest.data(), static_cast<unsigned>(block));
    if (count < 0 || rest.substr(0, static_cast<std::size_t>(count)).find_first_not_of('\0') != std::string::npos) {
      return false;
    }
  }
  buffer_.resize(first);
  return true;
}

Expected<bool> LineReader::next(std::string_view& line) {
  std::size_t end = buffer_.find('\n', at_);
  while (end == std::string::npos && !ended_) {
    const std::size_t searched = buffer_.size() - at_;
    if (searched > longest_line) {
      return fail(ErrorKind::bad_input,
                  fmt::format("{}: line {}: longer than {} bytes{}", name_, number_ + 1, longest_line,
                              number_ == 0 && (buffer_.starts_with('[') || buffer_.starts_with('{'))
                                  ? ": JSON in one line; `jq -c '.[]'` makes a line of each object of an array"
                                  : ""));
    }
    const Expected<bool> more = refill();
    if (!more) {
      return tl::unexpected(more.error());
    }
    ended_ = !*more;
    end = buffer_.find('\n', at_ + searched);
  }
  if (at_ >= buffer_.size()) {
    return false;
  }
  const std::size_t stop = end == std::string::npos ? buffer_.size() : end;
  line = std::string_view(buffer_).substr(at_, stop - at_);
  at_ = end == std::string::npos ? stop : end + 1;
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (++number_ == 1 && line.starts_with(byte_order_mark)) {
    line.remove_prefix(byte_order_mark.size());
  }
  return true;
}

}  // namespace selfcal::import
