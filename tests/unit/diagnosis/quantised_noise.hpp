// Recordings with noise of a coarse quantum: independent draws of each axis' white noise of rate, of force and of the accelerometers'
// integral, louder where it is said.
#pragma once

#include <cmath>
#include <functional>
#include <random>

#include "tests/unit/estimator/simulated.hpp"

namespace selfcal::diagnosis::quantised_noise {

constexpr double rate_hz = 50.0;
constexpr std::uint64_t seed = 3;

struct Axes {
  Vector3 arw, vrw, integral;  // deg/sqrt(h), ug/sqrt(Hz), um/sqrt(s)
};

// Perfect sensors and this noise; that of the accelerometers times `louder` of the time.
inline Recording recording_with(
    const Axes& axes, const std::function<double(double)>& louder = [](double) { return 1.0; }) {
  sim::SimConfig config;
  config.sample_rate_hz = rate_hz;
  config.gyro_arw_deg_per_sqrt_h = 0.0;
  config.accel_vrw_ug_per_sqrt_hz = 0.0;
  config.gyro_lsb_arcsec = 1e-6;
  config.accel_lsb_m_per_s = 1e-10;
  Recording r = *sim::simulate(config, *named_schedule("horizontal", 58.0, 5.0), seed, {});
  std::mt19937_64 random(seed);
  std::normal_distribution<double> unit;
  const double root_dt = std::sqrt(1.0 / rate_hz);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    double before = 0.0;
    for (std::size_t i = 0; i < r.time_s.size(); ++i) {
      const double times = louder(r.time_s[i]);
      r.delta_theta_rad[i][axis] += axes.arw(k) * units::degree_per_sqrt_hour * root_dt * unit(random);
      const double now = times * 1e-6 * axes.integral(k) / root_dt * unit(random);
      r.delta_v_mps[i][axis] +=
          times * axes.vrw(k) * units::micro_g_per_sqrt_hz * root_dt * unit(random) + now - before;
      before = now;
    }
  }
  return r;
}

}  // namespace selfcal::diagnosis::quantised_noise
