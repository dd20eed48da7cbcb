#include "sim_ins/base_motion.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {
namespace {

struct Derivatives {  // value, first, second derivative in time
  double value = 0.0;
  double first = 0.0;
  double second = 0.0;
};

void add(Derivatives& sum, const std::vector<Sine>& sines, double t) {
  for (const Sine& sine : sines) {
    const double w = 2.0 * std::numbers::pi / sine.period_s;
    const double argument = w * t + sine.phase;
    const double s = sine.amplitude * std::sin(argument);
    sum.value += s;
    sum.first += sine.amplitude * w * std::cos(argument);
    sum.second -= w * w * s;
  }
}

void add(Derivatives& sum, const std::vector<Settling>& settlings, double t) {
  for (const Settling& settling : settlings) {
    const double value = settling.amplitude * std::exp(-t / settling.tau_s);
    sum.value += value;
    sum.first -= value / settling.tau_s;
    sum.second += value / (settling.tau_s * settling.tau_s);
  }
}

constexpr std::size_t degree = 5;
using Weights = std::array<double, degree + 1>;

// Weights of the coefficients from `degree` before a knot to the knot, `u` of a step behind it (de Boor 1978), of each degree up to the fifth;
// coefficient k counts from knot k on.
std::array<Weights, degree + 1> weights_at(double u) {
  std::array<Weights, degree + 1> w{};
  w[0][0] = 1.0;
  for (std::size_t d = 1; d <= degree; ++d) {
    for (std::size_t j = 0; j <= d; ++j) {
      const double before = j > 0 ? w[d - 1][j - 1] : 0.0, behind = j < d ? w[d - 1][j] : 0.0;
      const auto whole = static_cast<double>(d), at = static_cast<double>(j);
      w[d][j] = ((u + whole - at) * before + (at + 1.0 - u) * behind) / whole;
    }
  }
  return w;
}

void add(Derivatives& sum, const std::vector<NoiseSpline>& splines, double t) {
  constexpr std::ptrdiff_t centre = 3;
  for (const NoiseSpline& s : splines) {
    const double at = t / s.step_s, knot = std::floor(at), rate = 1.0 / s.step_s;
    const std::array<Weights, degree + 1> w = weights_at(at - knot);
    const auto n = static_cast<std::ptrdiff_t>(s.coefficients.size());
    // Derivatives are differences of the coefficients with the weights of one degree less.
    const auto weight = [&w](std::size_t d, std::size_t j, std::size_t less) {
      return j >= less && j - less <= d ? w[d][j - less] : 0.0;
    };
    for (std::size_t j = 0; j <= degree; ++j) {
      const std::ptrdiff_t k = static_cast<std::ptrdiff_t>(knot) - static_cast<std::ptrdiff_t>(degree) +
                               static_cast<std::ptrdiff_t>(j) + centre;
      const double c = s.coefficients[static_cast<std::size_t>((k % n + n) % n)];
      sum.value += c * w[degree][j];
      sum.first += c * rate * (weight(degree - 1, j, 1) - weight(degree - 1, j, 0));
      sum.second +=
          c * rate * rate * (weight(degree - 2, j, 2) - 2.0 * weight(degree - 2, j, 1) + weight(degree - 2, j, 0));
    }
  }
}

}  // namespace

bool BaseMotion::still() const {
  return roll.empty() && pitch.empty() && yaw.empty() && surge.empty() && heave.empty() && sway.empty() &&
         settling_roll.empty() && settling_pitch.empty() && settling_surge.empty() && settling_heave.empty() &&
         settling_sway.empty() && noise_roll.empty() && noise_pitch.empty() && noise_surge.empty() &&
         noise_sway.empty();
}

BaseMotion moored_base_motion() {
  BaseMotion motion;
  motion.roll = {{0.5 * units::degree, 8.0, 0.0}};
  motion.pitch = {{0.3 * units::degree, 6.0, 1.0}};
  motion.yaw = {{0.2 * units::degree, 11.0, 2.0}, {0.05 * units::degree, 130.0, 0.5}};
  motion.heave = {{0.05, 9.0, 0.3}};
  motion.surge = {{0.08, 13.0, 1.3}};
  motion.sway = {{0.06, 10.0, 2.3}};
  return motion;
}

BaseState base_state(const BaseMotion& motion, const Attitude& mean, double t) {
  BaseState state;
  state.attitude = mean;
  state.p_n = state.v_n = state.a_n = Vector3::Zero();
  if (motion.still()) {
    return state;
  }
  Derivatives roll, pitch, yaw, surge, heave, sway;
  add(roll, motion.roll, t);
  add(roll, motion.settling_roll, t);
  add(roll, motion.noise_roll, t);
  add(pitch, motion.pitch, t);
  add(pitch, motion.settling_pitch, t);
  add(pitch, motion.noise_pitch, t);
  add(yaw, motion.yaw, t);
  add(surge, motion.surge, t);
  add(surge, motion.settling_surge, t);
  add(surge, motion.noise_surge, t);
  add(heave, motion.heave, t);
  add(heave, motion.settling_heave, t);
  add(sway, motion.sway, t);
  add(sway, motion.settling_sway, t);
  add(sway, motion.noise_sway, t);
  state.attitude.roll += roll.value;
  state.attitude.pitch += pitch.value;
  state.attitude.heading += yaw.value;
  state.attitude_rate = {roll.first, pitch.first, yaw.first};
  const double c = std::cos(mean.heading);
  const double s = std::sin(mean.heading);
  const auto along_n = [&](double forward, double up, double right) {
    return Vector3(c * forward - s * right, up, s * forward + c * right);
  };
  state.p_n = along_n(surge.value, heave.value, sway.value);
  state.v_n = along_n(surge.first, heave.first, sway.first);
  state.a_n = along_n(surge.second, heave.second, sway.second);
  return state;
}

}  // namespace selfcal::sim
