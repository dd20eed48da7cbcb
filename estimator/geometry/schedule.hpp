// A rotation schedule: where the gimbal stands, for how long, and how long it takes to move on.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace selfcal {

struct GimbalPosition {
  double outer_deg = 0.0;  // about v's z axis
  double inner_deg = 0.0;  // about the y axis of the frame that outer carries
};

struct Schedule {
  std::vector<GimbalPosition> positions;
  std::vector<double> dwell_s;  // one per position
  double rotation_s = 5.0;      // from one position to the next

  double duration_s() const;
};

// "table2": Table 2 of Zhang & Jiang (2019). "horizontal": the same up to position 13, then the inner axis is turned
// while it lies level. Every position is held for dwell_s.
std::optional<Schedule> named_schedule(std::string_view name, double dwell_s = 150.0, double rotation_s = 5.0);

}  // namespace selfcal
