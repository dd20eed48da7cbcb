// One effect that the 24-parameter model leaves out: its equation as columns, one per coefficient.
//
// An effect is linear in its coefficients. What it is not linear in (a time constant, a frequency) is `constant`, taken
// from a grid and refined by the fit.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

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
};

struct EffectParameter {
  std::string name;
  std::string unit;
  double si_per_unit = 1.0;
  double typical = 0.0;  // size in the unit that such sensors show
};

using Columns = Eigen::Ref<Eigen::Matrix3Xd>;

struct Effect {
  std::string id;  // as in the catalogue
  std::string equation;
  std::string excited;     // where it shows, in words
  std::string experiment;  // what would tell it from its rivals
  std::vector<EffectParameter> parameters;
  // Grid of the constant; {NaN}: none. Several variants of an effect are alternatives.
  std::vector<double> constants = {NAN};
  std::string_view constant_name, constant_unit;
  // Adds the integrals over the stretch of d(df)/d(coefficient) and d(dw)/d(coefficient), SI.
  void (*sensor)(const EffectContext&, double constant, Columns velocity, Columns angle) = nullptr;
  // Displacement of the base along n per unit coefficient at a time, for motions that are no sensor error.
  void (*displacement)(double t, double constant, Columns metres) = nullptr;
  bool needs_temperature = false;
};

// int exp(-s/tau) ds over the part of the stretch that lies after a turn; s counts from the end of the last turn.
inline double decay_integral(const EffectContext& c, double tau) {
  return tau * (std::exp(-c.since_turn_start_s / tau) - std::exp(-c.since_turn_end_s / tau));
}
// int (1 - exp(-t/tau)) dt over the stretch.
inline double warm_up_integral(const EffectContext& c, double tau) {
  return c.dt - tau * (std::exp(-c.start_s / tau) - std::exp(-c.end_s / tau));
}
// Adds `value` per axis to the diagonal of the first three columns.
inline void add_axes(Columns columns, const Vector3& value) { columns.leftCols<3>().diagonal() += value; }
// One unknown per axis, or per element of a 3 x 3 matrix (row: the axis affected).
std::vector<EffectParameter> axis_parameters(const std::string& unit, double si_per_unit, double typical);
std::vector<EffectParameter> matrix_parameters(const std::string& unit, double si_per_unit, double typical);
// Columns of M v for the nine elements of M, row by row.
void add_matrix(Columns columns, const Vector3& v);

}  // namespace selfcal::diagnosis
