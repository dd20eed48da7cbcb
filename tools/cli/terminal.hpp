// What is shown to people only: colour and progress. A script never needs it.
#pragma once

#include <cstdio>
#include <string>

namespace selfcal::cli {

// A terminal, and NO_COLOR (no-color.org) unset or empty.
bool use_colour(std::FILE* stream);

// Columns of a terminal; 0 where `stream` is none: text is not broken then.
int text_columns(std::FILE* stream);

// One line on standard error that is written over and wiped at the end; silent where that is no terminal. It is cut to
// the width that the terminal has at that time, so that it never takes a second row.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool visible() const { return visible_; }
  // Characters that a line may have now.
  int room() const;
  // Draws it unless it stands there already.
  void show(const std::string& text);
  // Wipes it, so that a line of another kind may follow; the next show() draws it again.
  void clear();

 private:
  bool visible_;
  int shown_ = 0;  // characters on the screen
  std::string text_;
  int width_ = 0;  // room() when it was drawn
};

}  // namespace selfcal::cli
