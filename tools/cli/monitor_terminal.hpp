// The terminal while `selfcal monitor` has it: curses, given back as it was on every way out.
#pragma once

#include <vector>

#include "tools/cli/monitor_view.hpp"

namespace selfcal::cli {

class MonitorTerminal {
 public:
  MonitorTerminal();
  ~MonitorTerminal();
  MonitorTerminal(const MonitorTerminal&) = delete;
  MonitorTerminal& operator=(const MonitorTerminal&) = delete;

  int columns() const;
  int rows() const;
  void draw(const std::vector<ScreenLine>& lines);
  // A key that waits, or -1. A resized terminal counts as no key.
  int key();
};

}  // namespace selfcal::cli
