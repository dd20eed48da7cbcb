// The sensor model on increments: the inverse of the virtual INS's errors, and its partials by central differences.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/geometry/units.hpp"
#include "estimator/models/sensor_model.hpp"
#include "sim_ins/sensor_errors.hpp"

namespace selfcal {
namespace {

constexpr double dt = 0.005;

// Three times the size of the source's Table 5, signs at random.
ParameterVector large_errors(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  ParameterVector p;
  const double sizes[] = {2300, 0.06, 1000, 1000, 950, 66, 770};  // ug, deg/h, ppm, ppm, arcsec, ppm, arcsec
  for (int k = 0; k < sensor_parameter_count; ++k) {
    p(k) = uniform(random) * sizes[std::min(k / 3, 6)] * sensor_parameters[static_cast<std::size_t>(k)].si_per_unit;
  }
  return p;
}

Vector3 random_vector(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  return {uniform(random), uniform(random), uniform(random)};
}

// Division and a triangular solution of condition 1: some ten roundings of the increment.
TEST(SensorCompensation, TakesOutWhatTheVirtualInsPutsIn) {
  std::mt19937_64 random(5);  // seed 5
  for (int trial = 0; trial < 200; ++trial) {
    const ParameterVector p = large_errors(random);
    sim::SensorErrors errors{};
    std::copy(p.begin(), p.end(), errors.begin());
    const Vector3 f = random_vector(random, 12.0);
    const Vector3 w = random_vector(random, 0.5);
    const SensorCompensation compensation(p);
    EXPECT_LT((compensation.velocity(dt * (f + sim::accel_error(errors, f)), dt) - dt * f).norm(), 1e-14 * dt * 12.0);
    EXPECT_LT((compensation.angle(dt * (w + sim::gyro_error(errors, w)), dt) - dt * w).norm(), 1e-14 * dt * 0.5);
  }
}

// d(compensated)/d(parameter) = -d(error)/d(parameter) at zero errors. With h = 1e-4 the central difference errs by h^2
// of the sensitivity (1/(1+K) to third order, products of angles), and rounds by 1e-16/h.
TEST(SensorCompensation, PartialsAreCentralDifferences) {
  std::mt19937_64 random(6);  // seed 6
  constexpr double h = 1e-4;
  for (int trial = 0; trial < 50; ++trial) {
    const Vector3 f = random_vector(random, 12.0), w = random_vector(random, 0.5);
    const Matrix3 C = matrix_from_rotation_vector(random_vector(random, 1.5));
    SensorIntegrals integrals{dt, dt * w, dt * f.cwiseMax(0.0), dt * (-f).cwiseMax(0.0)};
    AccelSensitivity accel = AccelSensitivity::Zero();
    GyroSensitivity gyro = GyroSensitivity::Zero();
    add_accel_sensitivity(C, integrals, 1.0, accel);
    add_gyro_sensitivity(C, integrals, 1.0, gyro);
    const auto difference = [&](int k, bool of_accel) -> Vector3 {
      const SensorCompensation plus(h * ParameterVector::Unit(k)), minus(-h * ParameterVector::Unit(k));
      const Vector3 change = of_accel ? plus.velocity(dt * f, dt) - minus.velocity(dt * f, dt)
                                      : plus.angle(dt * w, dt) - minus.angle(dt * w, dt);
      return -C * change / (2.0 * h);
    };
    for (int c = 0; c < accel_parameter_count; ++c) {
      const int k = accel_parameter_index[static_cast<std::size_t>(c)];
      // A bias of h moves f by h: no sign changes, because |f| > h.
      ASSERT_GT(f.cwiseAbs().minCoeff(), 10.0 * h);
      EXPECT_LT((accel.col(c) - difference(k, true)).norm(), 2.0 * h * h * dt * 12.0 + 1e-15 * dt * 12.0 / h)
          << sensor_parameters[static_cast<std::size_t>(k)].name;
      EXPECT_EQ(difference(k, false), Vector3::Zero());
    }
    for (int c = 0; c < gyro_parameter_count; ++c) {
      const int k = gyro_parameter_index[static_cast<std::size_t>(c)];
      EXPECT_LT((gyro.col(c) - difference(k, false)).norm(), 2.0 * h * h * dt * 0.5 + 1e-15 * dt / h)
          << sensor_parameters[static_cast<std::size_t>(k)].name;
      EXPECT_EQ(difference(k, true), Vector3::Zero());
    }
  }
}

}  // namespace
}  // namespace selfcal
