// The line that `selfcal run` shows while a run is under way: one clock, as much as the terminal's width holds.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace selfcal::cli {

struct RunProgressView {
  std::string words;  // what is being done
  std::string state;
  bool link_up = true;
  double left_s = -1.0;  // until the rotation ends, on the operator's clock; -1: it does not turn
  int position = 0, positions = 0;
  unsigned pages_pulled = 0, pages_expected = 0;
  int pass = 0;
  double pass_fraction = 0.0;
  std::vector<double> sigma, tolerance;  // 24 each, in the unit of sensor_parameters; empty: no estimate yet
};

// Parts by importance: what is done, a lost link, time left, position, how many of the 24 are known, which needs most
// yet, pages. A part that does not fit any more is left out whole. At most `columns` characters.
std::string progress_line(unsigned long long run, const RunProgressView& view, int columns);

// "12:34"; "1:02:03" from an hour on.
std::string clock_text(double seconds);

}  // namespace selfcal::cli
