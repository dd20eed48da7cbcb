#include "daemon/estimate/showing_schedule.hpp"

#include <cmath>

#include "estimator/geometry/units.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal {
namespace {

constexpr double slower = 3.0;  // a second turn rate

ShowingSchedule longer(Schedule schedule) {
  for (double& dwell : schedule.dwell_s) {
    dwell *= 2.0;
  }
  return {"the same with dwells twice as long", std::move(schedule)};
}

ShowingSchedule slow_turns(Schedule schedule) {
  schedule.rotation_s *= slower;
  return {"the same with turns at a third of the rate", std::move(schedule)};
}

ShowingSchedule there_and_back(Schedule schedule) {
  for (std::size_t k = schedule.positions.size() - 1; k > 0; --k) {
    schedule.positions.push_back(schedule.positions[k - 1]);
    schedule.dwell_s.push_back(schedule.dwell_s[k - 1]);
  }
  return {"the same, then all of it backwards", std::move(schedule)};
}

}  // namespace

ShowingSchedule dwells_between(const Schedule& done) {
  Schedule s;
  s.rotation_s = done.rotation_s;
  for (std::size_t k = 0; k < done.positions.size(); ++k) {
    const GimbalPosition& to = done.positions[k];
    if (k > 0) {
      const GimbalPosition& from = done.positions[k - 1];
      s.positions.push_back({0.5 * (from.outer_deg + to.outer_deg), 0.5 * (from.inner_deg + to.inner_deg)});
      s.dwell_s.push_back(0.5 * done.dwell_s[k]);
    }
    s.positions.push_back(to);
    s.dwell_s.push_back(0.5 * done.dwell_s[k]);
  }
  return {"dwells half as long, and one half way through each turn", std::move(s)};
}

std::optional<ShowingSchedule> showing_schedule(const std::string& experiment, const Schedule& done) {
  const auto asks_for = [&](const char* words) { return experiment.find(words) != std::string::npos; };
  if (asks_for("dwells at 45 deg")) {
    return dwells_between(done);
  }
  if (asks_for("second turn rate")) {
    return slow_turns(done);
  }
  if (asks_for("turns in both senses") && !done.positions.empty()) {
    return there_and_back(done);
  }
  if (asks_for("longer recording") || asks_for("longer dwell")) {
    return longer(done);
  }
  return std::nullopt;
}

Schedule schedule_of(const Recording& recording, const ImuData& data) {
  Schedule schedule;
  double turning = 0.0;
  std::size_t turns = 0;
  GimbalPosition last;
  const auto nearest = [](double angle_deg, double to_deg) {
    return to_deg + std::remainder(angle_deg - to_deg, 360.0);
  };
  for (const Segment& s : find_segments(data)) {
    if (s.rotation) {
      turning += s.end_s - s.start_s;
      ++turns;
      continue;
    }
    // A read-out may be folded into one turn; a move is less than half of one.
    last = {nearest(s.outer / units::degree, last.outer_deg), nearest(s.inner / units::degree, last.inner_deg)};
    schedule.positions.push_back(last);
    schedule.dwell_s.push_back(s.end_s - s.start_s);
  }
  schedule.rotation_s = turns > 0 ? turning / static_cast<double>(turns) : schedule.rotation_s;
  const std::size_t stated = recording.schedule_deg.size();
  if (stated == schedule.positions.size() && recording.dwell_s && recording.rotation_s) {
    schedule.rotation_s = *recording.rotation_s;
    for (std::size_t k = 0; k < stated; ++k) {
      schedule.positions[k] = {nearest(schedule.positions[k].outer_deg, recording.schedule_deg[k][0]),
                               nearest(schedule.positions[k].inner_deg, recording.schedule_deg[k][1])};
      schedule.dwell_s[k] = *recording.dwell_s;
    }
  }
  return schedule;
}

}  // namespace selfcal
