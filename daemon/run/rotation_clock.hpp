// How long a rotation took on the operator's clock, as far as this daemon saw it begin and end. What the INS answered counts,
// status frames do not.
#pragma once

#include <optional>

#include "daemon/host/timers.hpp"

namespace selfcal {

// The rotation took at least and at most so long. `most_s` is absent where its beginning or its end was not seen: the
// daemon was restarted meanwhile.
struct RotationTime {
  double least_s = 0.0;
  std::optional<double> most_s;
};

class RotationClock {
 public:
  // The start is about to be asked for: a rotation that was under way before is forgotten.
  void start_asked(SteadyTime now);
  // The INS was asked for its state at `asked`, and its answer came at `answered`.
  void state_told(bool rotating, SteadyTime asked, SteadyTime answered);

  RotationTime time() const;

 private:
  std::optional<SteadyTime> start_asked_;
  std::optional<SteadyTime> turned_from_, turned_until_;  // it turned at least from then until then
  std::optional<SteadyTime> over_;
};

}  // namespace selfcal
