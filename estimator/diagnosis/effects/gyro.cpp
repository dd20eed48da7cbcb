// What a gyro does to the rate that it turns at, under the specific force and the field that act on it.
#include <array>

#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Scale factor that differs between positive and negative turns.
void scale_asymmetry(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.angle.cwiseAbs());
}

// Scale factor that depends on the rate.
void scale_nonlinearity(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.angle.cwiseProduct(c.rate.cwiseAbs()));
}

// Drift linear in time.
void ramp(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(0.5 * (c.start_s + c.end_s) * c.dt));
}

// Lock-in at low rate: the output lags by a little, in the sense of the rate.
void dead_zone(const EffectContext& c, double rate_constant, Columns /*velocity*/, Columns angle) {
  add_axes(angle, -c.dt * (c.rate / rate_constant).array().tanh().matrix());
}

// Drift proportional to specific force, and to the magnetic field in b.
void g_sensitivity(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_matrix(angle, c.u * c.dt);
}
void magnetic_sensitivity(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_matrix(angle, c.field_b * c.dt);
}

constexpr std::array zone_rates = {0.2 * units::degree_per_hour, 5.0 * units::degree_per_hour,
                                   20.0 * units::degree_per_hour};
constexpr EffectConstant zone_width = {.kind = EffectConstant::Kind::grid,
                                       .grid = zone_rates,
                                       .name = "w0",
                                       .unit = "rad/s",
                                       .physics_key = "width",
                                       .physics_per_unit = 1.0 / units::degree_per_hour};

// Drift with sine and cosine of either gimbal angle: no member of the catalogue, for it is no physics.
void gimbal_functions(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  const std::array<double, 4> functions = {std::sin(c.outer), std::cos(c.outer), std::sin(c.inner), std::cos(c.inner)};
  for (std::size_t k = 0; k < functions.size(); ++k) {
    add_axes(angle.middleCols<3>(static_cast<Eigen::Index>(3 * k)), Vector3::Constant(functions[k] * c.dt));
  }
}

// What a drift leaves that is named after gravity, field or rate and follows the attitude otherwise.
std::shared_ptr<const Effect> attitude_functions() {
  Effect e{.triad = Triad::gyro, .sensor = gimbal_functions, .needs_gimbal = true};
  for (int k = 0; k < 4; ++k) {
    const std::vector<EffectParameter> axes = axis_parameters("deg/h", units::degree_per_hour, 0.01);
    e.parameters.insert(e.parameters.end(), axes.begin(), axes.end());
  }
  return std::make_shared<const Effect>(std::move(e));
}

}  // namespace

std::vector<Effect> gyro_effects() {
  std::vector<Effect> all;
  all.push_back({.id = "gyro_scale_asymmetry",
                 .words = "gyro scale factor that differs between the two senses of turning",
                 .place = 110,
                 .equation = "dw_i = a_i |w_i|",
                 .excited = "rotations",
                 .experiment = "turns in both senses",
                 .parameters = axis_parameters("ppm", units::ppm, 10.0),
                 .triad = Triad::gyro,
                 .sensor = scale_asymmetry});
  all.push_back({.id = "gyro_scale_nonlinearity",
                 .words = "gyro scale factor that depends on the rate",
                 .place = 120,
                 .equation = "dw_i = c_i w_i |w_i|",
                 .excited = "rotations, by the change of rate within them",
                 .experiment = "a second turn rate",
                 .parameters = axis_parameters("ppm/(deg/s)", units::ppm / units::degree, 1.0),
                 .triad = Triad::gyro,
                 .sensor = scale_nonlinearity});
  all.push_back({.id = "gyro_drift_ramp",
                 .words = "gyro drift that changes steadily with time",
                 .place = 130,
                 .equation = "dw_i = c_i t",
                 .excited = "whole recording",
                 .experiment = "a longer recording",
                 .parameters = axis_parameters("deg/h/h", units::degree_per_hour / units::hour, 0.01),
                 .triad = Triad::gyro,
                 .sensor = ramp,
                 .lack_of_fit = std::make_shared<const Effect>(gyro_warm_up())});
  all.push_back({.id = "gyro_dead_zone",
                 .words = "dead zone (lock-in) of the gyros at low rate",
                 .place = 180,
                 .equation = "dw_i = -a_i tanh(w_i/w0)",
                 .excited = "dwells, by the sign of the Earth rate on the axis",
                 .experiment = "a second heading",
                 .parameters = axis_parameters("deg/h", units::degree_per_hour, 0.01),
                 .constant = zone_width,
                 .triad = Triad::gyro,
                 .sensor = dead_zone,
                 .lack_of_fit = attitude_functions()});
  all.push_back({.id = "gyro_g_sensitivity",
                 .words = "gyro drift proportional to specific force (g-sensitivity)",
                 .place = 190,
                 .equation = "dw_i = sum_j G_ij u_j",
                 .excited = "dwells",
                 .experiment = "a tilted base, a second heading",
                 .parameters = matrix_parameters("deg/h/g", units::degree_per_hour, 0.01),
                 .triad = Triad::gyro,
                 .sensor = g_sensitivity,
                 .lack_of_fit = attitude_functions(),
                 .linear_in_force = true});
  all.push_back({.id = "gyro_magnetic_sensitivity",
                 .words = "gyro drift proportional to the magnetic field",
                 .place = 200,
                 .equation = "dw_i = sum_j M_ij B_j",
                 .excited = "dwells",
                 .experiment = "a second heading, a coil",
                 .parameters = matrix_parameters("deg/h/G", units::degree_per_hour, 0.02),
                 .triad = Triad::gyro,
                 .sensor = magnetic_sensitivity,
                 .lack_of_fit = attitude_functions(),
                 .needs_heading = true});
  return all;
}

}  // namespace selfcal::diagnosis
