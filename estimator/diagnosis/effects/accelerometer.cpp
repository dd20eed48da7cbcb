// What an accelerometer does to the specific force that acts on it.
#include <array>

#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr std::array creep_tau_s = {10.0, 20.0, 35.0, 60.0, 100.0, 170.0};

// Creep after each turn.
void relaxation(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(decay_integral(c, tau)));
}

// Bias linear in time.
void ramp(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(0.5 * (c.start_s + c.end_s) * c.dt));
}

// Nonlinearity in the input axis. In dwells with |u| 0 or 1 the scale factors stand for the second order.
void quadratic(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.u.cwiseAbs2() * c.dt);
}
void cubic(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.u.cwiseAbs2().cwiseProduct(c.u) * c.dt);
}

std::vector<EffectParameter> second_order(std::initializer_list<const char*> names) {
  std::vector<EffectParameter> all;
  for (const char* name : names) {
    all.push_back({name, "ug/g^2", units::micro_g, 20.0});
  }
  return all;
}
// Products of two axes in one accelerometer. Squares of the other axes are an effect of their own: with those of its own axis they add up
// to the square of gravity, which is a bias, so that beside them a non-linearity has no place of its own.
void cross_coupling(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  constexpr int products[3][3][2] = {{{0, 1}, {0, 2}, {1, 2}}, {{0, 1}, {1, 2}, {0, 2}}, {{0, 2}, {1, 2}, {0, 1}}};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 3; ++k) {
      velocity(axis, 3 * axis + k) += c.u(products[axis][k][0]) * c.u(products[axis][k][1]) * c.dt;
    }
  }
}
void cross_squares(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  constexpr int other[3][2] = {{1, 2}, {0, 2}, {0, 1}};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 2; ++k) {
      velocity(axis, 2 * axis + k) += c.u(other[axis][k]) * c.u(other[axis][k]) * c.dt;
    }
  }
}

}  // namespace

std::vector<Effect> accelerometer_effects() {
  std::vector<Effect> all;
  all.push_back({.id = "accel_relaxation",
                 .words = "creep of the accelerometers after each turn",
                 .place = 30,
                 .equation = "df_i = r_i exp(-s/tau), s since the turn",
                 .excited = "first minutes of the dwells after a turn",
                 .experiment = "a longer dwell after fewer turns",
                 .parameters = axis_parameters("ug", units::micro_g, 50.0),
                 .constant = time_constant(creep_tau_s),
                 .triad = Triad::accelerometer,
                 .sensor = relaxation,
                 .since_turns = true});
  all.push_back({.id = "accel_bias_ramp",
                 .words = "accelerometer bias that changes steadily with time",
                 .place = 40,
                 .equation = "df_i = c_i t",
                 .excited = "whole recording",
                 .experiment = "a longer recording, a temperature channel",
                 .parameters = axis_parameters("ug/h", units::micro_g / units::hour, 20.0),
                 .triad = Triad::accelerometer,
                 .sensor = ramp,
                 .lack_of_fit = std::make_shared<const Effect>(accel_warm_up())});
  all.push_back({.id = "accel_quadratic",
                 .words = "accelerometer error quadratic in its input",
                 .place = 90,
                 .equation = "df_i = k_i u_i^2",
                 .excited = "rotations",
                 .experiment = "dwells at 45 deg",
                 .parameters = axis_parameters("ug/g^2", units::micro_g, 20.0),
                 .triad = Triad::accelerometer,
                 .sensor = quadratic});
  all.push_back({.id = "accel_cubic",
                 .words = "accelerometer error cubic in its input",
                 .place = 100,
                 .equation = "df_i = k_i u_i^3",
                 .excited = "rotations",
                 .experiment = "dwells at 45 deg",
                 .parameters = axis_parameters("ug/g^3", units::micro_g, 10.0),
                 .triad = Triad::accelerometer,
                 .sensor = cubic});
  all.push_back({.id = "accel_cross_coupling",
                 .words = "accelerometer error from products of two axes (cross-coupling)",
                 .place = 230,
                 .equation = "df_i = k u_j u_k, j != k",
                 .excited = "rotations, tilted dwells",
                 .experiment = "dwells at 45 deg, a tilted base",
                 .parameters = second_order({"x_xy", "x_xz", "x_yz", "y_xy", "y_yz", "y_xz", "z_xz", "z_yz", "z_xy"}),
                 .triad = Triad::accelerometer,
                 .sensor = cross_coupling});
  all.push_back({.id = "accel_cross_squares",
                 .words = "accelerometer error from the squares of the other axes",
                 .place = 231,
                 .equation = "df_i = k u_j^2, j != i",
                 .excited = "rotations, tilted dwells",
                 .experiment = "dwells at 45 deg, a tilted base",
                 .parameters = second_order({"x_yy", "x_zz", "y_xx", "y_zz", "z_xx", "z_yy"}),
                 .triad = Triad::accelerometer,
                 .sensor = cross_squares});
  return all;
}

bool has_squares_of_others(const Effect& effect) { return effect.sensor == cross_squares; }
bool has_square_of_own(const Effect& effect) { return effect.sensor == quadratic; }

}  // namespace selfcal::diagnosis
