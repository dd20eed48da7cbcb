#include "tools/cli/monitor_terminal.hpp"

// curses.h defines macros with common names: nothing else is included after it.
#include <curses.h>

#include <cstdlib>

namespace selfcal::cli {
namespace {

int attribute(ScreenLine::Style style) {
  switch (style) {
    case ScreenLine::Style::title: return A_BOLD;
    case ScreenLine::Style::good: return A_BOLD | (has_colors() ? COLOR_PAIR(1) : 0);
    case ScreenLine::Style::bad: return A_REVERSE | (has_colors() ? COLOR_PAIR(2) : 0);
    case ScreenLine::Style::faint: return A_DIM;
    case ScreenLine::Style::plain: break;
  }
  return A_NORMAL;
}

}  // namespace

MonitorTerminal::MonitorTerminal() {
  initscr();  // ends the program with a message where TERM is unknown
  cbreak();
  noecho();
  curs_set(0);
  keypad(stdscr, TRUE);
  nodelay(stdscr, TRUE);
  if (has_colors() && std::getenv("NO_COLOR") == nullptr) {
    start_color();
    use_default_colors();
    init_pair(1, COLOR_BLUE, -1);  // told from each other by bold and reverse too
    init_pair(2, COLOR_YELLOW, -1);
  }
}

MonitorTerminal::~MonitorTerminal() { endwin(); }

int MonitorTerminal::columns() const { return COLS; }
int MonitorTerminal::rows() const { return LINES; }

void MonitorTerminal::draw(const std::vector<ScreenLine>& lines) {
  erase();
  int row = 0;
  for (const ScreenLine& line : lines) {
    attrset(attribute(line.style));
    mvaddnstr(row++, 0, line.text.c_str(), COLS);
  }
  attrset(A_NORMAL);
  refresh();
}

int MonitorTerminal::key() {
  const int pressed = getch();
  return pressed == ERR || pressed == KEY_RESIZE ? -1 : pressed;
}

}  // namespace selfcal::cli
