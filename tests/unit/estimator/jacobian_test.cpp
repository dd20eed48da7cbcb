// The linear error model of an update interval (Phi and Gamma, forward and in reverse) against central differences of a
// nonlinear navigator that shares nothing with it.
//
// Step sizes: a central difference errs by h^2/6 of the third derivative; relative to the first that is about h^2/6 for
// angles (1e-4 rad: 2e-9), (h/R)^2 for positions and (h T/R)^2 for velocities (2e-8 at 1 km, 1e-13 at 1 m/s); in the
// sensor errors the motion is linear to their square. Rounding: 400 steps of quaternion algebra turn the attitude by at
// most 8 of 1.1e-16 each, 3.5e-13 rad, which tilts gravity; over the step.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/geometry/units.hpp"
#include "estimator/navigation/interval_navigator.hpp"
#include "estimator/passes/pass.hpp"
#include "tests/unit/estimator/motion_data.hpp"
#include "tests/unit/estimator/oracle_navigator.hpp"

namespace selfcal {
namespace {

using test::MotionData;
using test::Perturbation;
using test::TurningGimbal;

constexpr double T = 1.0;  // s, the interval
constexpr double R = earth::semi_major_axis;
constexpr double attitude_rounding = 3.5e-13;  // rad

// Of the states of one row, for a step h.
double rounding(int row, double h) {
  const double g = 9.8;
  const double tilt = row < StateLayout::velocity ? 0.5 * g * T * T : row < StateLayout::attitude ? g * T : 1.0;
  return attitude_rounding / h * tilt;
}

struct Case {
  const char* name;
  double rate_deg_per_s, sign, latitude_deg;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class ErrorModel : public ::testing::TestWithParam<Case> {
 protected:
  // No component of the specific force changes its sign during the turn: max(f, 0) has no derivative there.
  TurningGimbal motion() const {
    return {{GetParam().latitude_deg * units::degree, 2.0, 50.0},
            {-20.0 * units::degree, 10.0 * units::degree, 30.0 * units::degree},
            40.0 * units::degree,
            GetParam().rate_deg_per_s * units::degree,
            25.0 * units::degree};
  }
  double begin() const { return GetParam().sign > 0.0 ? 0.0 : T; }
  double end() const { return T - begin(); }

  Vector9 central_difference(const Perturbation& plus, const Perturbation& minus, double step) const {
    return (test::navigation_error(motion(), plus, begin(), end()) -
            test::navigation_error(motion(), minus, begin(), end())) /
           (2.0 * step);
  }

  Interval interval() const {
    const TurningGimbal m = motion();
    // Simpson's rule: rates are constant but for Earth's, the force turns by 1.6 mrad a sample.
    const auto simpson = [](auto function) {
      return [function](double a, double b) -> Vector3 {
        return (b - a) / 6.0 * (function(a) + 4.0 * function(0.5 * (a + b)) + function(b));
      };
    };
    const MotionData data(m.site, 200.0, T, simpson([m](double t) { return m.omega_ib_b(t); }),
                          simpson([m](double t) { return m.f_ib_b(t); }));
    IntervalNavigator navigator(data.view(), ParameterVector::Zero(), m.C_nb(begin()), GetParam().sign, T);
    Interval result;
    EXPECT_TRUE(navigator.next(result));
    return result;
  }
};

// Phi is exp(s T F) to the third order: element by element the rest is below |F T|^4/24 (1 + |F T|).
TEST_P(ErrorModel, TransitionOfTheNavigationErrors) {
  const SiteModel site(motion().site);
  const Matrix9 Phi = transition(site, -site.gravity_n, T, GetParam().sign);
  Matrix9 F = site.F_rest;
  F.block<3, 3>(StateLayout::velocity, StateLayout::attitude) = skew(-site.gravity_n);
  const Matrix9 size = T * F.cwiseAbs();
  const Matrix9 rest = size * size * size * size / 24.0 * (Matrix9::Identity() + size);
  const double steps[3] = {1000.0, 1.0, 1e-4};  // m, m/s, rad
  for (int column = 0; column < 9; ++column) {
    Perturbation plus, minus;
    const double h = steps[column / 3];
    Vector3 d = Vector3::Zero();
    d(column % 3) = h;
    (column < 3 ? plus.position : column < 6 ? plus.velocity : plus.attitude) = d;
    (column < 3 ? minus.position : column < 6 ? minus.velocity : minus.attitude) = -d;
    const Vector9 numeric = central_difference(plus, minus, h);
    for (int row = 0; row < 9; ++row) {
      const double tolerance = 3e-8 * std::abs(Phi(row, column)) + rest(row, column) + rounding(row, h);
      EXPECT_NEAR(Phi(row, column), numeric(row), tolerance) << "row " << row << ", column " << column;
    }
  }
  // The interval's own Phi: its mean force differs from gravity by (Omega T)^2/6 at most.
  const double force = std::pow(earth::rotation_rate * T, 2) / 6.0 + 1e-12;
  EXPECT_LT((interval().Phi - Phi).cwiseAbs().maxCoeff(), 10.0 * T * force);
}

// Gamma neglects what the Earth's rate does to an error within the interval, 2 Omega T (Coriolis) of it, and takes the
// attitude of a block's middle, 4e-7. What it neglects altogether is the turn of n by a velocity error: T/(R cos L).
TEST_P(ErrorModel, SensitivityToThe24) {
  const Interval model = interval();
  for (int k = 0; k < sensor_parameter_count; ++k) {
    const bool accel = k < parameter::gyro_drift || (k >= parameter::accel_scale_pos && k < parameter::gyro_scale);
    const double step = k < parameter::gyro_drift ? 1e-3 : k < parameter::accel_scale_pos ? 1e-5 : 1e-4;  // SI
    Perturbation plus, minus;
    plus.errors[static_cast<std::size_t>(k)] = step;
    minus.errors[static_cast<std::size_t>(k)] = -step;
    const Vector9 numeric = central_difference(plus, minus, step);
    const std::string_view name = sensor_parameters[static_cast<std::size_t>(k)].name;
    for (int part = 0; part < 9; part += 3) {
      const Vector3 expected = numeric.segment<3>(part);
      const Vector3 found = model.Gamma.col(k).segment<3>(part);
      const double velocity = accel ? numeric.segment<3>(StateLayout::velocity).norm() : 0.0;
      const double turn_of_n = T * velocity / (R * std::cos(motion().site.latitude));
      const double neglected = part == StateLayout::attitude ? turn_of_n : 0.0;
      const double relative = 2.0 * earth::rotation_rate * T + 1e-6 + step * step;
      EXPECT_LT((found - expected).norm(), relative * expected.norm() + neglected + 2.0 * rounding(part, step))
          << name << ", states from " << part << ": " << found.transpose() << " against " << expected.transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Motions, ErrorModel,
                         ::testing::Values(Case{"dwell_forward", 0.0, 1.0, 40.0},
                                           Case{"dwell_reverse", 0.0, -1.0, 40.0},
                                           Case{"turn_forward", 18.0, 1.0, 40.0},
                                           Case{"turn_reverse", 18.0, -1.0, 40.0},
                                           Case{"turn_back_south", -18.0, 1.0, -75.0}),
                         [](const auto& c) { return c.param.name; });

// What is observed: position error plus the motion of the base, the displacement of the axis's oscillation.
TEST(Measurement, IsPositionPlusMotion) {
  struct Rows : PassObserver {
    void propagated(const Interval&, const UdFilter&) override {}
    void updated(int axis, const VectorX& h, const ScalarInnovation&, const UdFilter&) override {
      rows[static_cast<std::size_t>(axis)] = h;
    }
    std::array<VectorX, 3> rows;
  } seen;
  const TurningGimbal still{{0.7, 2.0, 50.0}, {}, 0.0, 0.0, 0.0};
  const MotionData data(
      still.site, 50.0, 5.0, [&](double a, double b) -> Vector3 { return (b - a) * still.omega_ib_b(a); },
      [&](double a, double b) -> Vector3 { return (b - a) * still.f_ib_b(a); });
  PassInput input;
  input.data = &data.view();
  input.C_nb = still.C_nb(0.0);
  input.prior.parameter_sigma = VectorX::Constant(sensor_parameter_count, 1e-3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    input.noise.observation.motion[axis].oscillations = {{0.6, 60.0, 0.02}};
  }
  run_pass(input, {}, {}, &seen);
  // The observation is computed position + displacement of the base; in the filter's own coordinates both are lengths
  // along n (earth_test holds the radii against ECEF), so the partials are ones, and differ from zero nowhere else.
  for (int axis = 0; axis < 3; ++axis) {
    VectorX expected = VectorX::Zero(StateLayout::navigation_count + 6);
    expected(StateLayout::position + axis) = 1.0;
    expected(StateLayout::navigation_count + 2 * axis) = 1.0;
    EXPECT_EQ(seen.rows[static_cast<std::size_t>(axis)], expected) << axis;
  }
}

}  // namespace
}  // namespace selfcal
