// What the Monte Carlo tries: one schedule on one base, and what is drawn anew for every run.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "estimator/geometry/schedule.hpp"
#include "sim_ins/config.hpp"

namespace selfcal::monte_carlo {

struct Case {
  std::string_view name;
  std::string_view schedule;  // as named_schedule() knows it
  double dwell_s = 150.0;
  double latitude_deg = 40.0;
  double roll_deg = 0.0, pitch_deg = 0.0;
  double heading_deg = -1.0;  // negative: drawn for every run
  bool moored = false;
};

const std::vector<Case>& all_cases();

Schedule schedule_of(const Case& c);

// The virtual INS of one run: ARW 0.001 deg/sqrt(h), VRW 5 ug/sqrt(Hz), 24 errors drawn uniformly within the sizes of
// the source's Table 5, heading (where the case leaves it free), and phases and periods of a moored base's motion.
// Same case and seed: the same bits.
sim::SimConfig configuration(const Case& c, double sample_rate_hz, std::uint64_t seed);

}  // namespace selfcal::monte_carlo
