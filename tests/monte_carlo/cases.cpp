#include "tests/monte_carlo/cases.hpp"

#include <numbers>

#include "sim_ins/random.hpp"

namespace selfcal::monte_carlo {
namespace {

constexpr std::uint64_t case_stream = 71;  // of the seed; the simulator takes others

// The reference motion, no two runs alike: phases anywhere, periods within 20 %, amplitudes 0.5 to 2 times.
void vary(std::vector<sim::Sine>& sines, sim::Random& random) {
  for (sim::Sine& sine : sines) {
    sine.amplitude *= random.uniform(0.5, 2.0);
    sine.period_s *= random.uniform(0.8, 1.2);
    sine.phase = random.uniform(0.0, 2.0 * std::numbers::pi);
  }
}

}  // namespace

const std::vector<Case>& all_cases() {
  static const std::vector<Case> cases = {
      {.name = "horizontal", .schedule = "horizontal"},
      {.name = "table2-pitch90", .schedule = "table2", .pitch_deg = 90.0},
      {.name = "horizontal-60s",
       .schedule = "horizontal",
       .dwell_s = 60.0,
       .latitude_deg = -33.0,
       .roll_deg = 4.0,
       .pitch_deg = -7.0,
       .heading_deg = 285.0},
      {.name = "moored", .schedule = "horizontal", .moored = true},
      {.name = "table2-level", .schedule = "table2"},
  };
  return cases;
}

Schedule schedule_of(const Case& c) { return *named_schedule(c.schedule, c.dwell_s); }

sim::SimConfig configuration(const Case& c, double sample_rate_hz, std::uint64_t seed) {
  sim::Random random(seed, case_stream);
  sim::SimConfig config;
  config.sample_rate_hz = sample_rate_hz;
  config.latitude_deg = c.latitude_deg;
  config.roll_deg = c.roll_deg;
  config.pitch_deg = c.pitch_deg;
  const double drawn_heading = random.uniform(0.0, 360.0);
  config.heading_deg = c.heading_deg < 0.0 ? drawn_heading : c.heading_deg;
  config.parameter_set = "random";
  if (c.moored) {
    config.base_motion = sim::moored_base_motion();
    sim::BaseMotion& m = config.base_motion;
    for (std::vector<sim::Sine>* sines : {&m.roll, &m.pitch, &m.yaw, &m.surge, &m.heave, &m.sway}) {
      vary(*sines, random);
    }
  }
  return config;
}

}  // namespace selfcal::monte_carlo
