// What earlier turns of the gimbal left behind in the sensors, for minutes.
#include <array>
#include <numbers>

#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Flexures and mountings are anelastic: what a load does to them, and to the mass unbalance of a gyro, sets in late.
void accel_lags(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_matrix(velocity, lag_integral(c, tau));
}
void gyro_lags(const EffectContext& c, double tau, Columns /*velocity*/, Columns angle) {
  add_matrix(angle, lag_integral(c, tau));
}

// The motors warm the block with each turn, and it cools.
void accel_heated(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(travel_integral(c, tau)));
}
void gyro_heated(const EffectContext& c, double tau, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(travel_integral(c, tau)));
}

constexpr std::array load_tau_s = {12.0, 35.0, 100.0};
constexpr std::array heat_tau_s = {60.0, 150.0, 400.0, 1000.0};
constexpr double revolution = 2.0 * std::numbers::pi;

}  // namespace

std::vector<Effect> after_turn_effects() {
  std::vector<Effect> all;
  all.push_back({.id = "accel_load_lag",
                 .words = "accelerometer error that follows a change of load late",
                 .place = 232,
                 .equation = "df = K (lag(u) - u), lag: first order, tau",
                 .excited = "first minutes of the dwells after a turn, by what the load was before it",
                 .experiment = "one face reached from several others",
                 .parameters = matrix_parameters("ug/g", units::micro_g, 20.0),
                 .constant = time_constant(load_tau_s),
                 .triad = Triad::accelerometer,
                 .sensor = accel_lags,
                 .since_turns = true});
  all.push_back({.id = "gyro_load_lag",
                 .words = "gyro drift that follows a change of load late",
                 .place = 205,
                 .equation = "dw = K (lag(u) - u), lag: first order, tau",
                 .excited = "first minutes of the dwells after a turn, by what the load was before it",
                 .experiment = "one face reached from several others",
                 .parameters = matrix_parameters("deg/h/g", units::degree_per_hour, 0.01),
                 .constant = time_constant(load_tau_s),
                 .triad = Triad::gyro,
                 .sensor = gyro_lags,
                 .since_turns = true});
  all.push_back({.id = "accel_turn_heat",
                 .words = "accelerometer bias that follows the heat of the gimbal's turns",
                 .place = 172,
                 .equation = "df_i = h_i A, A' = |turn rate| - A/tau",
                 .excited = "dwells after turns, most after many in short time",
                 .experiment = "long dwells between few turns, then many turns at once",
                 .parameters = axis_parameters("ug/rev", units::micro_g / revolution, 100.0),
                 .constant = time_constant(heat_tau_s),
                 .triad = Triad::accelerometer,
                 .sensor = accel_heated,
                 .since_turns = true});
  all.push_back({.id = "gyro_turn_heat",
                 .words = "gyro drift that follows the heat of the gimbal's turns",
                 .place = 174,
                 .equation = "dw_i = h_i A, A' = |turn rate| - A/tau",
                 .excited = "dwells after turns, most after many in short time",
                 .experiment = "long dwells between few turns, then many turns at once",
                 .parameters = axis_parameters("deg/h/rev", units::degree_per_hour / revolution, 0.05),
                 .constant = time_constant(heat_tau_s),
                 .triad = Triad::gyro,
                 .sensor = gyro_heated,
                 .since_turns = true});
  return all;
}

}  // namespace selfcal::diagnosis
