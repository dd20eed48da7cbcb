// Where no name fits: smooth functions that describe the misfit. A description, never an explanation.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"

namespace selfcal::diagnosis {

struct EmpiricalTerm {
  std::string axis;                 // gyro_x ... accel_z
  std::string function;             // of gimbal angles, gravity direction, time, temperature
  std::string unit;                 // deg/h or ug
  double value = 0.0, sigma = 0.0;  // in the unit
  double held_out_gain = 0.0;       // log likelihood on dwells and rotations left out in turn, when the term was added
};

struct EmpiricalDescription {
  std::vector<EmpiricalTerm> terms;  // in the order in which they were taken
  double share = 0.0;                // of the misfit beyond noise that they take away
  double held_out_gain = 0.0;        // of all together
};

// Terms are added while each is significant after correction for all that were tried and also gains on the parts of
// the recording that were left out; at most eight. None lies nearly inside the span of what is fitted, and none has a coefficient
// that no sensor can have (plausible_limit).
EmpiricalDescription describe_empirically(const ImuData& data, const Diagnosis& diagnosis, double false_alarm_rate);

}  // namespace selfcal::diagnosis
