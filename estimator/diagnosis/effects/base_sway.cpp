// The base sways: real motion of the host at one frequency; no sensor error.
#include <numbers>

#include "estimator/diagnosis/effects/declare.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(double t, double frequency, Columns metres) {
  const double phase = 2.0 * std::numbers::pi * frequency * t;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    metres(axis, 2 * axis) += std::sin(phase);
    metres(axis, 2 * axis + 1) += std::cos(phase);
  }
}

}  // namespace

// Its frequencies are found in the spectrum of the innovations: the grid is empty here.
Effect base_sway() {
  Effect e;
  e.id = "base_sway";
  e.equation = "d = a sin(2 pi f t) + b cos(2 pi f t) along north, up, east";
  e.excited = "everywhere, at its own frequency";
  e.experiment = "a recording on a still base";
  for (const char* name : {"north_sin", "north_cos", "up_sin", "up_cos", "east_sin", "east_cos"}) {
    e.parameters.push_back({name, "mm", 1e-3, 1.0});
  }
  e.constants = {};
  e.constant_name = "frequency";
  e.constant_unit = "Hz";
  e.displacement = columns;
  return e;
}

}  // namespace selfcal::diagnosis
