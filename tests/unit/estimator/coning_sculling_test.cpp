// Navigation at 200 Hz against the same motion at 4 kHz: what the algorithm leaves of coning and sculling.
//
// (N2), (N3) with b = 2 pi f T, T the sample time. Coning of half-angle A: the gyros turn by the vector A (cos, sin),
// the exact correction of a sample is A^2 (b - sin b)/2, that of the algorithm |a- x a|/12 = A^2 (1 - cos b) sin b/6.
// Their difference, A^2 (-b^5/60 + ...), over T is the residual drift. Sculling, rotation A sin and force F sin of the
// same frequency w: exact (A F/2w)(b - sin b), algorithm (A F/6w)(1 - cos b) sin b; the same series with A F/w for A^2.
// The very first sample lacks its predecessor, and so the algorithm's whole correction, once. At 4 kHz b^5/T is
// 20^4 = 160,000 times smaller.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/geometry/units.hpp"
#include "estimator/navigation/interval_navigator.hpp"
#include "tests/unit/estimator/motion_data.hpp"

namespace selfcal {
namespace {

constexpr double length_s = 10.0;
constexpr double slow_hz = 200.0, fast_hz = 4000.0;
constexpr double amplitude = 1.0 * units::degree;
const earth::Position site{40.0 * units::degree, 0.0, 0.0};

struct Vibration {
  double frequency_hz;
  double bound;  // stated: of the residual, deg/h or ug

  friend std::ostream& operator<<(std::ostream& out, const Vibration& v) { return out << v.frequency_hz << " Hz"; }
};

double algorithm(double b) { return (1.0 - std::cos(b)) * std::sin(b) / 6.0; }
// Mean over the whole time of algorithm less truth, per sample.
double residual_per_sample(double b) {
  return algorithm(b) * (1.0 - 1.0 / (length_s * slow_hz)) - (b - std::sin(b)) / 2.0;
}

struct Navigated {
  Matrix3 C_nb;
  Vector3 velocity = Vector3::Zero();  // sum of the drifts over the intervals, m/s
};

Navigated navigate(double rate_hz, const test::MotionData::Integral& angle, const test::MotionData::Integral& velocity,
                   const Matrix3& C_nb) {
  const test::MotionData data(site, rate_hz, length_s, angle, velocity);
  IntervalNavigator navigator(data.view(), ParameterVector::Zero(), C_nb, 1.0, 1.0);
  Interval interval;
  Navigated result;
  while (navigator.next(interval)) {
    result.velocity -= interval.drive.segment<3>(StateLayout::velocity);
  }
  result.C_nb = navigator.C_nb();
  return result;
}

// Terms of higher order in the amplitude: A^2 = 3e-4 of the residual, and a few times that from the axis of the cone,
// which is 1 deg off the attitude at the start.
constexpr double higher_orders = 0.005;

class Coning : public ::testing::TestWithParam<Vibration> {};

TEST_P(Coning, ResidualDriftIsTheAlgorithms) {
  const double w = 2.0 * std::numbers::pi * GetParam().frequency_hz;
  const double rim = std::sin(amplitude), along = -2.0 * w * std::pow(std::sin(0.5 * amplitude), 2);
  const auto angle = [&](double a, double b) -> Vector3 {  // exact integrals of coning rates
    return {along * (b - a), rim * (std::cos(w * b) - std::cos(w * a)), rim * (std::sin(w * b) - std::sin(w * a))};
  };
  const double g = earth::normal_gravity(site.latitude, 0.0);
  const auto velocity = [g](double a, double b) -> Vector3 { return {0.0, g * (b - a), 0.0}; };
  const Matrix3 C = Matrix3::Identity();
  const Matrix3 slow = navigate(slow_hz, angle, velocity, C).C_nb;
  const Matrix3 fast = navigate(fast_hz, angle, velocity, C).C_nb;
  const Vector3 drift = rotation_vector_from_matrix(slow * fast.transpose()) / length_s;
  const double expected = rim * rim * residual_per_sample(w / slow_hz) * slow_hz;
  EXPECT_NEAR(drift.x(), expected, higher_orders * std::abs(expected) + 1e-14);
  EXPECT_LT(drift.norm() / units::degree_per_hour, GetParam().bound);
}

// Stated bounds for a cone of 1 deg, far beyond what a moored or parked host does.
INSTANTIATE_TEST_SUITE_P(Frequencies, Coning,
                         ::testing::Values(Vibration{5.0, 0.025}, Vibration{10.0, 0.7}, Vibration{20.0, 20.0}));

class Sculling : public ::testing::TestWithParam<Vibration> {};

TEST_P(Sculling, ResidualAccelerationIsTheAlgorithms) {
  constexpr double force = 1.0;  // m/s^2
  const double w = 2.0 * std::numbers::pi * GetParam().frequency_hz;
  const double g = earth::normal_gravity(site.latitude, 0.0);
  // x up: the rotation leaves gravity alone; y north; the rectified acceleration shows along z, west.
  Matrix3 C;
  C << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  const auto angle = [&](double a, double b) -> Vector3 {
    return {amplitude * (std::sin(w * b) - std::sin(w * a)), 0, 0};
  };
  const auto velocity = [&](double a, double b) -> Vector3 {
    return {g * (b - a), -force / w * (std::cos(w * b) - std::cos(w * a)), 0};
  };
  const Vector3 slow = navigate(slow_hz, angle, velocity, C).velocity;
  const Vector3 fast = navigate(fast_hz, angle, velocity, C).velocity;
  const Vector3 residual = (slow - fast) / length_s;
  const double expected = amplitude * force / w * residual_per_sample(w / slow_hz) * slow_hz;
  EXPECT_NEAR(-residual.z(), expected, higher_orders * std::abs(expected) + 1e-12);
  EXPECT_LT(residual.norm() / units::micro_g, GetParam().bound);
}

INSTANTIATE_TEST_SUITE_P(Frequencies, Sculling,
                         ::testing::Values(Vibration{5.0, 0.03}, Vibration{10.0, 0.4}, Vibration{20.0, 6.0}));

}  // namespace
}  // namespace selfcal
