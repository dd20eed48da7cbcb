// The equations of the concealed effects that act through the sensors: what they add to the measured specific force
// and angular rate at one instant of the true motion.
#pragma once

#include <span>
#include <string_view>

#include "estimator/geometry/rotation.hpp"
#include "sim_ins/config.hpp"

namespace selfcal::sim {

// One instant, all that an equation may depend on. u is f_ib_b over standard gravity.
struct SensorContext {
  double t = 0.0;  // s since the recording's start
  Matrix3 C_nb = Matrix3::Identity();
  Vector3 f_ib_b = Vector3::Zero();                // m/s^2
  Vector3 omega_ib_b = Vector3::Zero();            // rad/s
  Vector3 angular_acceleration = Vector3::Zero();  // rad/s^2, set only where an effect needs it
  const TemperatureConfig* temperature = nullptr;
  double since_turn_s = -1.0;         // since the last turn's end; negative before the first
  Vector3 turn_df = Vector3::Zero();  // change of f_ib_b from before to after the last turn
  double outer = 0.0;                 // rad, true
  double inner = 0.0;

  Vector3 u() const;
};

struct SensorDeviation {
  Vector3 df = Vector3::Zero();      // m/s^2
  Vector3 domega = Vector3::Zero();  // rad/s
};

// p: the effect's values, SI, in the order of its description. Adds to the deviation.
using SensorEquation = void (*)(std::span<const double> p, const SensorContext& context, SensorDeviation& deviation);

// Of the first nine values, row by row.
Matrix3 matrix_of(std::span<const double> p);

// nullptr for the effects that act on the base, the noise, the sampling or the data.
SensorEquation sensor_equation(std::string_view effect_id);
// Whether the equation reads angular_acceleration.
bool needs_angular_acceleration(std::string_view effect_id);

// True temperature, its rate, and that rate behind a first-order lag tau that starts at rest; degC, degC/s.
double temperature_at(const TemperatureConfig& config, double t);
double lagged_temperature_rate(const TemperatureConfig& config, double t, double tau_s);

}  // namespace selfcal::sim
