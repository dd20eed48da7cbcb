// What is no error of a sensor: motion of the base, seen in the observed position, and a site that is another.
#include <array>
#include <cstdio>
#include <numbers>

#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::array settling_tau_s = {60.0, 120.0, 240.0, 480.0, 960.0, 1920.0};
void settling(double t, double tau, Columns metres) { add_axes(metres, Vector3::Constant(std::exp(-t / tau))); }

void sway(double t, double frequency, Columns metres) {
  const double phase = 2.0 * std::numbers::pi * frequency * t;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    metres(axis, 2 * axis) += std::sin(phase);
    metres(axis, 2 * axis + 1) += std::cos(phase);
  }
}

std::vector<EffectParameter> sway_parameters() {
  std::vector<EffectParameter> all;
  for (const char* name : {"north_sin", "north_cos", "up_sin", "up_cos", "east_sin", "east_cos"}) {
    all.push_back({name, "mm", 1e-3, 1.0});
  }
  return all;
}

// The site's latitude is another: the Earth's rate points elsewhere.
void latitude(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  const Vector3 n = c.C_nb * c.earth_rate_b;  // cos, sin of the latitude, 0
  const Vector3 by_latitude = earth::rotation_rate * Vector3(-n.y(), n.x(), 0.0);
  angle.col(0) += c.C_nb.transpose() * by_latitude * c.dt;
}

std::string wrong_latitude(const Eigen::VectorXd& value, const Eigen::VectorXd& sigma, const earth::Position& site) {
  const double stated = site.latitude / units::degree;
  char words[160];
  std::snprintf(words, sizeof words,
                "the Earth's rate as sensed stands as at latitude %.3f +- %.3f deg, the site's is %.3f deg",
                stated + value(0), sigma(0), stated);
  return words;
}

}  // namespace

std::vector<Effect> base_effects() {
  std::vector<Effect> all;
  all.push_back({.id = "base_settling",
                 .words = "base that settles during the recording",
                 .place = 240,
                 .equation = "d = a exp(-t/tau) along north, up, east",
                 .excited = "whole recording, mostly its start",
                 .experiment = "waiting before the start",
                 .parameters = {{"north", "mm", 1e-3, 1.0}, {"up", "mm", 1e-3, 1.0}, {"east", "mm", 1e-3, 1.0}},
                 .constant = time_constant(settling_tau_s),
                 .displacement = settling});
  all.push_back({.id = "base_sway",
                 .words = "sway of the base",
                 .place = 250,
                 .equation = "d = a sin(2 pi f t) + b cos(2 pi f t) along north, up, east",
                 .excited = "everywhere, at its own frequency",
                 .experiment = "a recording on a still base",
                 .parameters = sway_parameters(),
                 .constant = {.kind = EffectConstant::Kind::spectrum, .grid = {}, .name = "frequency", .unit = "Hz"},
                 .displacement = sway,
                 .motion_of_moored_base = true});
  all.push_back({.id = "wrong_site",
                 .words = "latitude of the site that is not the true one",
                 .place = 260,
                 .equation = "dw = dOmega/dlatitude * (latitude - the site's)",
                 .excited = "dwells, by the Earth rate's angle to gravity",
                 .experiment = "the site's coordinates, looked up again",
                 .parameters = {{"latitude", "deg", units::degree, 0.01}},
                 .sensor = latitude,
                 .data_fault = wrong_latitude});
  return all;
}

}  // namespace selfcal::diagnosis
