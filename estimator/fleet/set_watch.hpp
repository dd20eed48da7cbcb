// Tells a test set that is biased from units that age. The last ten measurements of a set, each of another unit, are held
// against what was expected of those units. A unit that ages shows in one of them, a set in all.
#pragma once

#include <deque>
#include <vector>

#include "estimator/fleet/unit_filter.hpp"

namespace selfcal::fleet {

inline constexpr int units_in_window = 10;
inline constexpr int least_units = 4;

struct SetVerdict {
  double bias = 0.0;  // weighted mean of the window, against the set's own offset, in the parameter's unit
  double z = 0.0;     // by its sigma, to which that of the offset belongs
  int units = 0;      // in the window
};

// Of one set and one parameter.
class SetWatch {
 public:
  explicit SetWatch(const SetOffset& offset) : offset_sigma_(offset.sigma) {}
  // In the order of time. A further measurement of a unit that is in the window takes the older one's place.
  SetVerdict add(int unit, const Innovation& innovation);

 private:
  struct Entry {
    int unit;
    Innovation innovation;
  };
  double offset_sigma_;
  std::deque<Entry> window_;
};

// How far a set has always stood off, by what sets of its type differ by: standard normal for a sound one. 0 where nothing is
// known of either.
double standing_offset_z(const TypeModel& model, int set);

// |z| beyond which a set is accused: by chance at most `rate` of sound sets within the time in which a set makes
// `measurements` of each of `parameters`, looked at after every one of them. measurements 0: one look.
double accusation_limit(double rate, int parameters, double measurements);

}  // namespace selfcal::fleet
