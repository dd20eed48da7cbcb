// One effect that the 24-parameter model leaves out: its equation as columns, one per coefficient.
//
// An effect is linear in its coefficients. What it is not linear in (a time constant, a frequency) is `constant`, taken
// from a grid and refined by the fit. What is special about an effect stands in its fields. An effect is known by its
// address; its id is for files and people.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/diagnosis/effects/turn_memory.hpp"
#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal::diagnosis {

// What the equations may use: a stretch in which b turns by 3 mrad at most, 1 s at most. b axes, SI, means over it.
struct EffectContext {
  double start_s = 0.0, end_s = 0.0;  // since the start of the recording
  double dt = 0.0;
  Vector3 angle, velocity;  // integrals of rate and specific force: rad, m/s
  Vector3 rate, force, u;   // means: rad/s, m/s^2, force in g
  Vector3 rate_change;      // rate at the end less rate at the start: rad/s, zero inside dwells
  Matrix3 C_nb;
  double since_turn_start_s = 0.0;         // part of the stretch after the end of the first turn, since the last one's
  double since_turn_end_s = 0.0;           // equal: none
  bool turning = false;                    // whether the middle lies within a turn of the gimbal
  double duration_s = 0.0;                 // of the recording
  double outer = NAN, inner = NAN;         // gimbal read-outs at the middle, rad; NaN: none
  double temperature = NAN;                // less its mean over the recording, degC; NaN: no channel
  Vector3 field_b;                         // magnetic field of an axial dipole Earth, gauss
  Vector3 earth_rate_b = Vector3::Zero();  // direction of the Earth's rate, unit length; zero: not known
  // Of the load u and of the angle that the gimbal's axes travelled (rad, first element); nullptr: not known.
  const TurnMemory *load_memory = nullptr, *travel_memory = nullptr;
};

struct EffectParameter {
  std::string name = {};
  std::string unit = {};
  double si_per_unit = 1.0;
  double typical = 0.0;  // size in the unit that such sensors show
};

using Columns = Eigen::Ref<Eigen::Matrix3Xd>;

// What an effect is not linear in.
struct EffectConstant {
  // grid: one of the values below, then refined. spectrum: a frequency at which the innovations have a line; an effect may
  // then be there several times, once a line.
  enum class Kind { none, grid, spectrum } kind = Kind::none;
  std::span<const double> grid = {};  // of static storage
  std::string_view name = {}, unit = {};
  std::string_view physics_key = {};  // its name in a physics file
  double physics_per_unit = 1.0;      // units of a physics file in one `unit`

  // Values that are tried: {NaN} for none, those of the grid; of a spectrum none are known before.
  std::vector<double> tried() const {
    return kind == Kind::none ? std::vector<double>{NAN} : std::vector<double>(grid.begin(), grid.end());
  }
};

// The triad whose output the equation changes; none: where the sensors sit, and what the base does.
enum class Triad { none, gyro, accelerometer };

// What follows the temperature follows the channel where there is one (`measured`), and warms up with a time constant to be
// found where there is none (`warm_up`): of the two variants a recording is asked about one.
enum class TemperatureUse { none, warm_up, measured };

struct Effect {
  std::string id = {};     // as in the catalogue
  std::string words = {};  // what it is, for people: "creep of the accelerometers after each turn"
  int place = 0;           // in the catalogue: simpler effects before those that contain them
  std::string equation = {};
  std::string excited = {};     // where it shows, in words
  std::string experiment = {};  // what would tell it from its rivals
  std::vector<EffectParameter> parameters = {};
  std::string physics_prefix = {};  // of the parameters' names in a physics file
  EffectConstant constant = {};
  Triad triad = Triad::none;
  TemperatureUse temperature = TemperatureUse::none;
  // Adds the integrals over the stretch of d(df)/d(coefficient) and d(dw)/d(coefficient), SI.
  void (*sensor)(const EffectContext&, double constant, Columns velocity, Columns angle) = nullptr;
  // Displacement of the base along n per unit coefficient at a time, for motions that are no sensor error.
  void (*displacement)(double t, double constant, Columns metres) = nullptr;
  // Columns of which a name given to something alike leaves some, looked for beside it, axis by axis in threes; null: none.
  std::shared_ptr<const Effect> lack_of_fit = nullptr;
  bool since_turns = false;      // the equation counts from the end of the last turn
  bool needs_gimbal = false;     // the equation reads the gimbal's angles
  bool needs_heading = false;    // the equation reads a direction that gravity does not give
  bool linear_in_force = false;  // every axis with every component of u: what a hand-turned triad is corrected by
  // Motion that the calibration of a moored base models already: found once more it is no mismatch.
  bool motion_of_moored_base = false;
  // Of an effect that is a fault of the data and no physics: what is wrong, in words; value and sigma in the parameters' units.
  std::string (*data_fault)(const Eigen::VectorXd& value, const Eigen::VectorXd& sigma,
                            const earth::Position& site) = nullptr;
};

// Which variant of an effect of the temperature a recording is asked about.
inline bool applies(const Effect& effect, bool has_temperature) {
  return effect.temperature != (has_temperature ? TemperatureUse::warm_up : TemperatureUse::measured);
}

// int exp(-s/tau) ds over the part of the stretch that lies after a turn; s counts from the end of the last turn.
inline double decay_integral(const EffectContext& c, double tau) {
  return tau * (std::exp(-c.since_turn_start_s / tau) - std::exp(-c.since_turn_end_s / tau));
}
// int (1 - exp(-t/tau)) dt over the stretch.
inline double warm_up_integral(const EffectContext& c, double tau) {
  return c.dt - tau * (std::exp(-c.start_s / tau) - std::exp(-c.end_s / tau));
}
// int (lag(u) - u) dt over the stretch, g s: the load of the last minutes less the present one. Zero where it is not known.
inline Vector3 lag_integral(const EffectContext& c, double tau) {
  return c.load_memory == nullptr ? Vector3::Zero() : Vector3(-c.load_memory->integral(c.start_s, c.end_s, tau));
}
// int A dt over the stretch, rad s: A the angle travelled, of which exp(-s/tau) counts s after.
inline double travel_integral(const EffectContext& c, double tau) {
  return c.travel_memory == nullptr ? 0.0 : c.travel_memory->integral(c.start_s, c.end_s, tau).x();
}
// Adds `value` per axis to the diagonal of the first three columns.
inline void add_axes(Columns columns, const Vector3& value) { columns.leftCols<3>().diagonal() += value; }
// One unknown per axis, or per element of a 3 x 3 matrix (row: the axis affected).
std::vector<EffectParameter> axis_parameters(const std::string& unit, double si_per_unit, double typical);
std::vector<EffectParameter> matrix_parameters(const std::string& unit, double si_per_unit, double typical);
// Columns of M v for the nine elements of M, row by row.
void add_matrix(Columns columns, const Vector3& v);
// For files and people.
std::vector<std::string> ids_of(const std::vector<const Effect*>& effects);
// A time constant in seconds that is one of the values of a grid to begin with.
EffectConstant time_constant(std::span<const double> grid);

}  // namespace selfcal::diagnosis
