// Concealed physics: what the 24-parameter model leaves out, each effect from its equation on the true motion.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "sim_ins/law.hpp"
#include "sim_ins/noise_spectrum.hpp"

namespace selfcal::sim {

// One number of an effect: its name in the file, the unit it is written in, SI value per unit, and the value taken
// where the file does not name it.
struct EffectParameter {
  std::string_view name;
  std::string_view unit;
  double si_per_unit = 1.0;
  double default_value = 0.0;  // in the unit
};

struct EffectDescription {
  std::string_view id;  // as in the mismatch catalogue, or, in_catalogue false, one of ours beyond it
  bool in_catalogue = true;
  std::span<const EffectParameter> parameters;
};

// Every effect the simulation knows.
std::span<const EffectDescription> physics_effects();

struct PhysicsEffect {
  std::string id;
  std::vector<double> values;  // SI, in the order of the description's parameters
};

// The effect's parameter of this name, SI. The effect must be one of physics_effects(), and have it.
double value_of(const PhysicsEffect& effect, std::string_view parameter);

// Effects add up. The same effect may stand twice (two spectral lines, two settlings).
struct ConcealedPhysics {
  std::vector<PhysicsEffect> effects;
  std::vector<Law> laws = {};
  std::vector<NoiseSpectrum> spectra = {};
};

// Reads a physics file:
//   [[effect]]
//   id = "accel_relaxation"
//   x = 50.0            # names and units as in physics_effects()
//   tau_s = 60.0
//   [[law]]
//   axis = "accel_z"
//   expression = "exp(-since/45.2)*so"   # or process = "jump per turn", "random walk", "white", "line"
//   coefficient = 13.7
//   unit = "ug"                          # ug for accel_*, deg/h for gyro_*
//   [[spectrum]]
//   channel = "gyro_x"                   # base_roll, base_pitch: tilt of the base
//   unit = "deg/h/sqrt(Hz)"              # ug/sqrt(Hz) for accel_*, arcsec/sqrt(Hz) for base_*
//   edges_hz = [0.0, 0.1, 50.0]
//   density = [2.0, 1.5]
//   [[spectrum.loudness]]                # may be left out: bands, rising, of noise that is loud at times
//   below_hz = 2.5                       # from the band before
//   step_s = 1.0
//   power = [0.5, 3.0, 0.5]              # over the table's, the first at the start
// Unknown id or key, wrong type, non-finite value: bad_input naming file, line and key.
[[nodiscard]] Expected<ConcealedPhysics> read_physics(const std::string& path);
[[nodiscard]] Expected<ConcealedPhysics> parse_physics(const std::string& text, const std::string& name);

}  // namespace selfcal::sim
