// Forward and then reverse navigation of the same samples comes back to where it began.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "estimator/geometry/units.hpp"
#include "estimator/navigation/interval_navigator.hpp"
#include "tests/unit/estimator/motion_data.hpp"

namespace selfcal {
namespace {

constexpr double length_s = 300.4;  // not a whole number of intervals
constexpr double rate_hz = 200.0;

// Turns of up to 30 deg/s, forces of up to 12 m/s^2, noise on every sample: nothing is special about the motion.
struct AnyMotion {
  test::MotionData data;
  explicit AnyMotion(std::mt19937_64& random)
      : data(
            {0.6, 1.0, 20.0}, rate_hz, length_s,
            [&random](double a, double b) -> Vector3 {
              std::normal_distribution<double> noise(0.0, 1e-6);
              return (b - a) * Vector3(0.4 * std::sin(0.21 * a), 0.3 * std::cos(0.13 * a), 0.2 * std::sin(0.34 * a)) +
                     Vector3(noise(random), noise(random), noise(random));
            },
            [](double a, double b) -> Vector3 {
              return (b - a) * Vector3(9.0 * std::sin(0.3 * a), 5.0, 6.0 * std::cos(0.17 * a));
            }) {}
};

ParameterVector some_parameters() {
  ParameterVector p;
  for (int k = 0; k < sensor_parameter_count; ++k) {
    p(k) = (k % 2 == 0 ? 1.0 : -1.0) * 100.0 * sensor_parameters[static_cast<std::size_t>(k)].si_per_unit;
  }
  return p;
}

// Each sample multiplies by the same unit quaternion and, in reverse, by its conjugate, each interval by the Earth's;
// left and right products commute, so in exact arithmetic the attitude is the same. A product and the normalisation
// round by at most 8 of 1.1e-16, in angle twice that: 2 x 60,000 samples add up to 2.2e-10 rad at worst.
TEST(ReverseNavigation, ComesBackToTheStart) {
  std::mt19937_64 random(11);  // seed 11
  const AnyMotion motion(random);
  const Matrix3 start = matrix_from_rotation_vector({0.3, -1.2, 0.7});
  const ParameterVector parameters = some_parameters();
  IntervalNavigator forward(motion.data.view(), parameters, start, 1.0, 1.0);
  Interval interval;
  std::vector<double> ends;
  while (forward.next(interval)) {
    ends.push_back(interval.end_s);
  }
  EXPECT_EQ(ends.size(), 301U);
  IntervalNavigator reverse(motion.data.view(), parameters, forward.C_nb(), -1.0, 1.0);
  while (reverse.next(interval)) {
  }
  const double bound = 2.0 * length_s * rate_hz * 2.0 * 8.0 * 1.1e-16;
  EXPECT_LT(rotation_vector_from_matrix(start.transpose() * reverse.C_nb()).norm(), bound);
  // Negative control: one sample turned by a part in a million of the motion is seen.
  EXPECT_LT(bound, 1e-6 * 0.4 / rate_hz);
}

// Velocity and position of one interval: what forward navigation drifted to, carried back by the reverse interval's
// transition, cancels the reverse drift: Phi_r d_f + d_r = 0. (N4) is of first order in Omega T, the specific force of
// a body at rest on the Earth being constant in n; with residual accelerations a the rest is (Omega T)^2 a T^2/2 and
// 2 Omega T of the turn (N4) leaves out of a position, a T^2/2.
TEST(ReverseNavigation, VelocityAndPositionComeBackToo) {
  const earth::Position site{0.6, 1.0, 20.0};
  const Matrix3 C = matrix_from_rotation_vector({0.3, -1.2, 0.7});
  const double g = earth::normal_gravity(site.latitude, site.height);
  const Vector3 residual(0.01, -0.02, 0.015);  // m/s^2: accelerometer errors of milli-g
  const test::MotionData data(
      site, rate_hz, 1.0,
      [&](double a, double b) -> Vector3 { return (b - a) * (C.transpose() * earth::omega_ie_n(site.latitude)); },
      [&](double a, double b) -> Vector3 { return (b - a) * (C.transpose() * (Vector3(0, g, 0) + residual)); });
  Interval forward, reverse;
  IntervalNavigator ahead(data.view(), ParameterVector::Zero(), C, 1.0, 1.0);
  ASSERT_TRUE(ahead.next(forward));
  IntervalNavigator back(data.view(), ParameterVector::Zero(), ahead.C_nb(), -1.0, 1.0);
  ASSERT_TRUE(back.next(reverse));
  EXPECT_NEAR(-forward.drive(StateLayout::velocity), residual.x(), 1e-4 * residual.norm());
  const Vector9 closed = reverse.Phi * forward.drive + reverse.drive;
  const double turn = earth::rotation_rate * 1.0;
  EXPECT_LT(closed.segment<3>(StateLayout::velocity).norm(), 2.0 * turn * residual.norm());
  EXPECT_LT(closed.segment<3>(StateLayout::position).norm(), 2.0 * turn * residual.norm());
}

}  // namespace
}  // namespace selfcal
