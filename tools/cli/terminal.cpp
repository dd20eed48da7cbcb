#include "tools/cli/terminal.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace selfcal::cli {
namespace {

constexpr const char* wipe_downwards = "\r\033[J";
constexpr int kept_free = 3;         // columns: "^C" and the last
constexpr int default_columns = 80;  // of a terminal that does not say

}  // namespace

bool use_colour(std::FILE* stream) {
  const char* no_color = std::getenv("NO_COLOR");
  return ::isatty(::fileno(stream)) == 1 && (no_color == nullptr || *no_color == '\0');
}

int text_columns(std::FILE* stream) {
  winsize size{};
  const int descriptor = ::fileno(stream);
  const bool known = ::isatty(descriptor) == 1 && ::ioctl(descriptor, TIOCGWINSZ, &size) == 0;
  return known ? size.ws_col : 0;
}

ProgressLine::ProgressLine() : visible_(::isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() { clear(); }

// What the terminal writes for Ctrl-C must fit behind it, and the last column stays free: a character there makes some
// terminals begin a new row.
int ProgressLine::room() const {
  const int columns = text_columns(stderr);
  return (columns > 0 ? columns : default_columns) - kept_free;
}

void ProgressLine::show(const std::string& text) {
  if (!visible_) {
    return;
  }
  const int width = room();
  if (shown_ > 0 && text == text_ && width == width_) {
    return;
  }
  clear();
  text_ = text;
  width_ = width;
  const std::string cut = text.substr(0, static_cast<std::size_t>(std::max(0, width)));
  fmt::print(stderr, "{}", cut);
  std::fflush(stderr);
  shown_ = static_cast<int>(cut.size());
}

// A terminal that became narrower has broken the line into rows: all of them go.
void ProgressLine::clear() {
  if (shown_ == 0) {
    return;
  }
  const int columns = room() + kept_free;
  const int rows_above = columns > 0 ? (shown_ - 1) / columns : 0;
  if (rows_above > 0) {
    fmt::print(stderr, "\033[{}A", rows_above);
  }
  fmt::print(stderr, "{}", wipe_downwards);
  std::fflush(stderr);
  shown_ = 0;
}

}  // namespace selfcal::cli
