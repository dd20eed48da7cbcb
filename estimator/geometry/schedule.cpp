#include "estimator/geometry/schedule.hpp"

#include <numeric>

namespace selfcal {
namespace {

const std::vector<GimbalPosition> common_part = {{0, 0},  {90, 0},  {180, 0},  {270, 0},  {180, 0},  {90, 0}, {0, 0},
                                                 {0, 90}, {90, 90}, {180, 90}, {270, 90}, {180, 90}, {90, 90}};
const std::vector<GimbalPosition> table2_end = {{0, 90}, {0, 180}, {0, 270}, {0, 180}, {0, 90}, {0, 0}};
const std::vector<GimbalPosition> horizontal_end = {{90, 180}, {90, 270}, {90, 180}, {90, 90}, {90, 0}, {0, 0}};

}  // namespace

double Schedule::duration_s() const {
  const double moves = positions.empty() ? 0.0 : static_cast<double>(positions.size() - 1);
  return std::accumulate(dwell_s.begin(), dwell_s.end(), 0.0) + moves * rotation_s;
}

std::optional<Schedule> named_schedule(std::string_view name, double dwell_s, double rotation_s) {
  if (name != "table2" && name != "horizontal") {
    return std::nullopt;
  }
  Schedule schedule;
  schedule.positions = common_part;
  const auto& end = name == "table2" ? table2_end : horizontal_end;
  schedule.positions.insert(schedule.positions.end(), end.begin(), end.end());
  schedule.dwell_s.assign(schedule.positions.size(), dwell_s);
  schedule.rotation_s = rotation_s;
  return schedule;
}

}  // namespace selfcal
