// What is shown to people only: colour and progress. A script never needs it.
#pragma once

#include <cstdio>
#include <string>

namespace selfcal::cli {

// A terminal, and NO_COLOR (no-color.org) unset or empty.
bool use_colour(std::FILE* stream);

// One line on standard error that is written over and wiped at the end; silent where that is no terminal.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool visible() const { return visible_; }
  void show(const std::string& text);

 private:
  bool visible_;
  bool shown_ = false;
};

}  // namespace selfcal::cli
