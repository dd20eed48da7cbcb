// How it is known that a gimbal which is told each move by itself has arrived. Times are of the INS's clock.
#pragma once

namespace selfcal::profile {

class Section;

struct Turning {
  bool by_angle = false;       // else by what the INS says of its state
  double tolerance_rad = 0.0;  // by angle: so near to the position
  double rest_rad = 0.0;       // by angle: it rests while its angles stay so near to each other
  double longest_move_s = 60.0;
};

// The keys `there`, `tolerance_deg`, `rest_deg` and `longest_s` of a table.
Turning read_turning(Section& section);

}  // namespace selfcal::profile
