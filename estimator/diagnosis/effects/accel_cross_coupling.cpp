// Products of two axes in one accelerometer.
#include "estimator/diagnosis/effects/declare.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

std::vector<EffectParameter> products() {
  std::vector<EffectParameter> all;
  for (const char* name : {"x_xy", "x_xz", "x_yz", "x_yy", "x_zz", "y_xy", "y_yz", "y_xz", "y_xx", "y_zz", "z_xz",
                           "z_yz", "z_xy", "z_xx", "z_yy"}) {
    all.push_back({name, "ug/g^2", units::micro_g, 20.0});
  }
  return all;
}

void columns(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  constexpr int products[3][5][2] = {{{0, 1}, {0, 2}, {1, 2}, {1, 1}, {2, 2}},
                                     {{0, 1}, {1, 2}, {0, 2}, {0, 0}, {2, 2}},
                                     {{0, 2}, {1, 2}, {0, 1}, {0, 0}, {1, 1}}};
  for (int axis = 0; axis < 3; ++axis) {
    for (int k = 0; k < 5; ++k) {
      velocity(axis, 5 * axis + k) += c.u(products[axis][k][0]) * c.u(products[axis][k][1]) * c.dt;
    }
  }
}

}  // namespace

Effect accel_cross_coupling() {
  Effect e;
  e.id = "accel_cross_coupling";
  e.equation = "df_i = k u_j u_k, j != i or k != i";
  e.excited = "rotations, tilted dwells";
  e.experiment = "dwells at 45 deg, a tilted base";
  e.parameters = products();
  e.sensor = columns;
  return e;
}

}  // namespace selfcal::diagnosis
