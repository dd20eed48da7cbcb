// Which of gyros, accelerometers and gimbal read-outs is the odd one out, and how. Private to this folder.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/data/axis_order.hpp"
#include "estimator/diagnosis/data/witnesses.hpp"
#include "estimator/geometry/earth.hpp"

namespace selfcal::diagnosis {

// What makes the read-outs right: exchanged first, then multiplied.
struct ReadOutOrder {
  bool swapped = false;
  int outer_sign = 1, inner_sign = 1;  // of the outer and inner angle after the exchange
  bool outer_degrees = false, inner_degrees = false;

  bool right() const { return *this == ReadOutOrder{}; }
  int changed() const;
  Matrix3 C_vb(const GimbalAngles& read) const;
  bool operator==(const ReadOutOrder&) const = default;
};

enum class Witness { none, gyros, accelerometers, imu, read_out, several };

// One account of a recording: the axes that each witness gives.
struct Explanation {
  AxisOrder gyros, accelerometers;
  ReadOutOrder read_out;
  double misfit = 0.0;   // minus twice the log likelihood, priors included
  double squared = 0.0;  // the share of the turns and of gravity, per observation: about 1 where it is right

  // The one that gives something wrong; `imu`: gyros and accelerometers alike.
  Witness odd() const;
};

// Every account of signed permutations of the three triads and of read-outs in degrees, best first. The observations are
// the turns (gyros against read-outs), gravity from one dwell to the next (accelerometers against gyros, and against
// read-outs), the base's upper side, the Earth's rate from dwell to dwell and its angle to gravity. Each witness that has
// to be wrong costs as much as an observation that is off by 4.5 sigma: the simplest account comes first.
std::vector<Explanation> explain(const Witnesses& witnesses, const earth::Position& site);

// Accounts beside the best one whose odds against it are better than 1 to 100 and that blame another witness, or change no
// more of the same: an axis that nothing excites could be wrong as well, and nobody asked.
std::vector<Explanation> rivals_of_best(const std::vector<Explanation>& all);

// Mean square over its expectation of what the unaltered witnesses say of each other, in pairs.
struct PairMisfit {
  double gyros_read_out = 0.0, gyros_accelerometers = 0.0, accelerometers_read_out = 0.0;
  Witness odd() const;  // by which pairs contradict each other; several: more than one could be
};
PairMisfit pair_misfit(const Witnesses& witnesses);

}  // namespace selfcal::diagnosis
