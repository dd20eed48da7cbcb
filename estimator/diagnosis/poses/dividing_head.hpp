// One accelerometer on a dividing head: stops at known angles about a horizontal axis, the multipoint test of IEEE Std 1293.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/poses/pose_parameter.hpp"

namespace selfcal::diagnosis {

struct HeadReadings {
  std::vector<double> angle_rad,
      reading;                 // in the order in which they were taken; readings of a stop follow one another
  double per_g = 0.0;          // nominal units of the reading per g of the place; 0: not known
  double gravity_sigma = 0.0;  // of gravity at the place, in parts of it
};

// reading = K1 (K0 + sin p + K2 sin^2 p + Kip sin p cos p), p the angle of the input axis above the horizontal: that of the head and a
// constant. What a pendulous axis does by its own square stands in K2.
struct DividingHead {
  int stops = 0, angles = 0;  // stops of all turns; angles that differ, of one turn
  double step_rad = 0.0;      // the widest gap between angles
  // bias and the coefficients in g and g per g^2, scale in 1 (nominal unit known) or raw per g, misalignment in rad: of the input axis against
  // the nearest quarter of the head's scale, its zero included.
  std::vector<PoseParameter> parameters;
  double level_rad = 0.0;  // the quarter of the scale at which the axis is level and rises with the angle
  double rms = 0.0;        // of what the stops leave, g
  double log_p_third =
      0.0;  // of a part of three times the angle: a cubic one, or what does not belong to the model; from 12 angles on
  double log_p_drift = 0.0;           // of a part that goes with the order of the stops
  bool third = false, drift = false;  // beyond chance, and in the fit then
  std::string failure;                // empty: done
};

// Sigma by what the stops leave, no smaller for angles that were visited again. `failure`: fewer than 8 angles, a gap of more than a third of a
// turn, angles that do not stand, a reading that does not belong to the others.
DividingHead judge_dividing_head(const HeadReadings& readings, double false_alarm_rate);

}  // namespace selfcal::diagnosis
