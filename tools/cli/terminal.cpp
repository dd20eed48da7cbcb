#include "tools/cli/terminal.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>

namespace selfcal::cli {
namespace {

constexpr const char* wipe_line = "\r\033[K";

}  // namespace

bool use_colour(std::FILE* stream) {
  const char* no_color = std::getenv("NO_COLOR");
  return ::isatty(::fileno(stream)) == 1 && (no_color == nullptr || *no_color == '\0');
}

ProgressLine::ProgressLine() : visible_(::isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (shown_) {
    fmt::print(stderr, "{}", wipe_line);
  }
}

void ProgressLine::show(const std::string& text) {
  if (visible_) {
    shown_ = true;
    fmt::print(stderr, "{}{}", wipe_line, text);
    std::fflush(stderr);
  }
}

}  // namespace selfcal::cli
