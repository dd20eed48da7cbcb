#include "estimator/discovery/step_with_turns.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {

bool in_step(std::span<const diagnosis::Turn> turns, double period_s) {
  constexpr std::size_t few = 4;  // any period is in step with less
  constexpr double even = 0.02;   // of the time from turn to turn
  constexpr int most_periods = 3;
  if (turns.size() < few || !(period_s > 0.0)) {
    return false;
  }
  const double cycles = static_cast<double>(turns.size() - 1);
  const double all_s = turns.back().start_s - turns.front().start_s;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const double expected_s = turns.front().start_s + all_s * static_cast<double>(k) / cycles;
    if (std::abs(turns[k].start_s - expected_s) > even * all_s / cycles) {
      return false;
    }
  }
  const double waves = all_s / period_s;
  for (int k = 1; k <= most_periods; ++k) {
    if (std::abs(waves - k * cycles) < 0.5) {
      return true;
    }
  }
  return false;
}

bool in_step_with_turns(std::span<const LawRecording> recordings, const LawTerm& law) {
  const bool wave = law.expression.text().find("2*pi*t/?") != std::string::npos && !law.constants.empty();
  return wave && std::all_of(recordings.begin(), recordings.end(), [&](const LawRecording& r) {
           return in_step(r.motion.context().turns(), law.constants.front() * units::hour);
         });
}

}  // namespace selfcal::discovery
