// Biases and scales that follow the temperature: the channel's where there is one, else a warm-up.
#include <array>

#include "estimator/diagnosis/effects/families.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Columns of one sensor are those of the other with velocity and angle exchanged.
void accel_bias_warms_up(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(warm_up_integral(c, tau)));
}
void accel_bias_follows(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, Vector3::Constant(c.temperature * c.dt));
}
void accel_scale_warms_up(const EffectContext& c, double tau, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.force * warm_up_integral(c, tau));
}
void accel_scale_follows(const EffectContext& c, double /*constant*/, Columns velocity, Columns /*angle*/) {
  add_axes(velocity, c.temperature * c.velocity);
}
void gyro_drift_warms_up(const EffectContext& c, double tau, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(warm_up_integral(c, tau)));
}
void gyro_drift_follows(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, Vector3::Constant(c.temperature * c.dt));
}
void gyro_scale_warms_up(const EffectContext& c, double tau, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.rate * warm_up_integral(c, tau));
}
void gyro_scale_follows(const EffectContext& c, double /*constant*/, Columns /*velocity*/, Columns angle) {
  add_axes(angle, c.temperature * c.angle);
}

constexpr std::array bias_tau_s = {60.0, 120.0, 240.0, 480.0, 960.0, 1920.0};
// A time constant far beyond the recording stands for a linear drift.
constexpr std::array scale_tau_s = {120.0, 480.0, 1920.0, 30000.0};

Effect accel_scale_warm_up() {
  return {.id = "accel_scale_temperature",
          .words = "accelerometer scale factor that follows temperature",
          .place = 70,
          .equation = "df_i = k_i (1 - exp(-t/tau)) f_i",
          .excited = "dwells, by axis along gravity",
          .experiment = "a temperature channel",
          .parameters = axis_parameters("ppm", units::ppm, 10.0),
          .physics_prefix = "warm_up_",
          .constant = time_constant(scale_tau_s),
          .triad = Triad::accelerometer,
          .temperature = TemperatureUse::warm_up,
          .sensor = accel_scale_warms_up};
}

Effect gyro_scale_warm_up() {
  return {.id = "gyro_scale_temperature",
          .words = "gyro scale factor that follows temperature",
          .place = 160,
          .equation = "dw_i = k_i (1 - exp(-t/tau)) w_i",
          .excited = "rotations, early against late",
          .experiment = "a temperature channel",
          .parameters = axis_parameters("ppm", units::ppm, 10.0),
          .physics_prefix = "warm_up_",
          .constant = time_constant(scale_tau_s),
          .triad = Triad::gyro,
          .temperature = TemperatureUse::warm_up,
          .sensor = gyro_scale_warms_up};
}

// A name for one slow curve leaves some of it where the truth is another one.
Effect leaving(const Effect& warm_up, Effect effect) {
  effect.lack_of_fit = std::make_shared<const Effect>(warm_up);
  return effect;
}

}  // namespace

Effect accel_warm_up() {
  return {.id = "accel_temperature",
          .words = "accelerometer bias that follows temperature",
          .place = 50,
          .equation = "df_i = b_i (1 - exp(-t/tau))",
          .excited = "whole recording, mostly its start",
          .experiment = "a temperature channel",
          .parameters = axis_parameters("ug", units::micro_g, 20.0),
          .physics_prefix = "warm_up_",
          .constant = time_constant(bias_tau_s),
          .triad = Triad::accelerometer,
          .temperature = TemperatureUse::warm_up,
          .sensor = accel_bias_warms_up};
}

Effect gyro_warm_up() {
  return {.id = "gyro_temperature",
          .words = "gyro drift that follows temperature",
          .place = 140,
          .equation = "dw_i = b_i (1 - exp(-t/tau))",
          .excited = "whole recording, mostly its start",
          .experiment = "a temperature channel",
          .parameters = axis_parameters("deg/h", units::degree_per_hour, 0.01),
          .physics_prefix = "warm_up_",
          .constant = time_constant(bias_tau_s),
          .triad = Triad::gyro,
          .temperature = TemperatureUse::warm_up,
          .sensor = gyro_drift_warms_up};
}

std::vector<Effect> thermal_effects() {
  std::vector<Effect> all;
  all.push_back(leaving(accel_warm_up(), accel_warm_up()));
  all.push_back(leaving(accel_warm_up(), {.id = "accel_temperature",
                                          .words = "accelerometer bias that follows temperature",
                                          .place = 60,
                                          .equation = "df_i = b_i (T - mean T)",
                                          .excited = "whole recording",
                                          .experiment = "heating the block",
                                          .parameters = axis_parameters("ug/degC", units::micro_g, 5.0),
                                          .triad = Triad::accelerometer,
                                          .temperature = TemperatureUse::measured,
                                          .sensor = accel_bias_follows}));
  all.push_back(leaving(accel_scale_warm_up(), accel_scale_warm_up()));
  all.push_back(leaving(accel_scale_warm_up(), {.id = "accel_scale_temperature",
                                                .words = "accelerometer scale factor that follows temperature",
                                                .place = 80,
                                                .equation = "df_i = k_i (T - mean T) f_i",
                                                .excited = "dwells, by axis along gravity",
                                                .experiment = "heating the block",
                                                .parameters = axis_parameters("ppm/degC", units::ppm, 2.0),
                                                .triad = Triad::accelerometer,
                                                .temperature = TemperatureUse::measured,
                                                .sensor = accel_scale_follows}));
  all.push_back(leaving(gyro_warm_up(), gyro_warm_up()));
  all.push_back(leaving(gyro_warm_up(), {.id = "gyro_temperature",
                                         .words = "gyro drift that follows temperature",
                                         .place = 150,
                                         .equation = "dw_i = b_i (T - mean T)",
                                         .excited = "whole recording",
                                         .experiment = "heating the block",
                                         .parameters = axis_parameters("deg/h/degC", units::degree_per_hour, 0.001),
                                         .triad = Triad::gyro,
                                         .temperature = TemperatureUse::measured,
                                         .sensor = gyro_drift_follows}));
  all.push_back(leaving(gyro_scale_warm_up(), gyro_scale_warm_up()));
  all.push_back(leaving(gyro_scale_warm_up(), {.id = "gyro_scale_temperature",
                                               .words = "gyro scale factor that follows temperature",
                                               .place = 170,
                                               .equation = "dw_i = k_i (T - mean T) w_i",
                                               .excited = "rotations",
                                               .experiment = "heating the block",
                                               .parameters = axis_parameters("ppm/degC", units::ppm, 2.0),
                                               .triad = Triad::gyro,
                                               .temperature = TemperatureUse::measured,
                                               .sensor = gyro_scale_follows}));
  return all;
}

}  // namespace selfcal::diagnosis
