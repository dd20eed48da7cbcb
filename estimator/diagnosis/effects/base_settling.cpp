// The base settles: real motion of the host, seen in the observed position; no sensor error.
#include "estimator/diagnosis/effects/declare.hpp"

namespace selfcal::diagnosis {
namespace {

void columns(double t, double tau, Columns metres) { add_axes(metres, Vector3::Constant(std::exp(-t / tau))); }

}  // namespace

Effect base_settling() {
  Effect e;
  e.id = "base_settling";
  e.equation = "d = a exp(-t/tau) along north, up, east";
  e.excited = "whole recording, mostly its start";
  e.experiment = "waiting before the start";
  e.parameters = {{"north", "mm", 1e-3, 1.0}, {"up", "mm", 1e-3, 1.0}, {"east", "mm", 1e-3, 1.0}};
  e.constants = {60.0, 120.0, 240.0, 480.0, 960.0, 1920.0};
  e.constant_name = "tau";
  e.constant_unit = "s";
  e.displacement = columns;
  return e;
}

}  // namespace selfcal::diagnosis
