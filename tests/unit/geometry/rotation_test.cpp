// Rotations by their group laws, and the signs of tools/handbook/frames-and-signs.md by cases worked out by hand.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

// A product of 3x3 matrices with entries up to 1 rounds by less than 3 eps each; a dozen such steps stay below this.
constexpr double rounding = 1e-14;
constexpr double quarter = 90.0 * units::degree;

std::vector<Vector3> rotation_vectors() {
  std::vector<Vector3> vectors = {Vector3::Zero(), {1e-8, 0, 0}, {0, -1e-8, 1e-8}, {0.02, 0, 0}, {0, 0.0201, 0}};
  std::mt19937_64 random(1);                                  // seed 1
  std::uniform_real_distribution<double> uniform(-1.7, 1.7);  // |phi| < 1.7 sqrt 3 = 2.95 < pi
  for (int i = 0; i < 100; ++i) {
    vectors.emplace_back(uniform(random), uniform(random), uniform(random));
  }
  return vectors;
}

TEST(Rotation, GroupLaws) {
  for (const Vector3& phi : rotation_vectors()) {
    SCOPED_TRACE(testing::Message() << "phi " << phi.transpose());
    const Matrix3 C = matrix_from_rotation_vector(phi);
    EXPECT_LT((C * C.transpose() - Matrix3::Identity()).norm(), rounding);
    EXPECT_NEAR(C.determinant(), 1.0, rounding);
    EXPECT_LT((C * matrix_from_rotation_vector(-phi) - Matrix3::Identity()).norm(), rounding);
    EXPECT_LT((matrix_from_rotation_vector(2.0 * phi) - C * C).norm(), rounding);
    // Near pi the angle is ill-conditioned by 1/cos(|phi|/2) < 11 in atan2's argument.
    EXPECT_LT((rotation_vector_from_matrix(C) - phi).norm(), 11.0 * rounding);
    if (phi.norm() < 1e-7) {  // first order: the rest is |phi|^2/2 < 2e-16
      EXPECT_LT((C - Matrix3::Identity() - skew(phi)).norm(), 1e-15);
    }
  }
}

TEST(Rotation, SkewIsTheCrossProduct) {
  EXPECT_EQ(skew({1, 2, 3}) * Vector3(4, 5, 6), Vector3(1, 2, 3).cross(Vector3(4, 5, 6)));
}

// n = north, up, east; v = forward, up, right.
TEST(Attitude, SignsAreTheMissions) {
  const Vector3 forward = Vector3::UnitX(), right = Vector3::UnitZ();
  const Vector3 north = Vector3::UnitX(), up = Vector3::UnitY(), east = Vector3::UnitZ();
  EXPECT_LT((attitude_matrix({0, 0, quarter}) * forward - east).norm(), rounding);
  EXPECT_LT((attitude_matrix({0, 0, quarter}) * right + north).norm(), rounding);
  EXPECT_LT((attitude_matrix({0, quarter, 0}) * forward - up).norm(), rounding);
  // Rx(90 deg) takes y to z: the vehicle's up points east, its right points down.
  EXPECT_LT((attitude_matrix({quarter, 0, 0}) * right + up).norm(), rounding);
  EXPECT_LT((attitude_matrix({quarter, 0, 0}) * Vector3::UnitY() - east).norm(), rounding);
}

TEST(Gimbal, OuterCarriesInner) {
  // Outer 90: b's x points up. Inner 90 about the carried y: b's x then lies where -z of v is.
  EXPECT_LT((gimbal_matrix(quarter, 0) * Vector3::UnitX() - Vector3::UnitY()).norm(), rounding);
  EXPECT_LT((gimbal_matrix(quarter, quarter) * Vector3::UnitX() + Vector3::UnitZ()).norm(), rounding);
  EXPECT_LT((gimbal_matrix(quarter, quarter) * Vector3::UnitY() + Vector3::UnitX()).norm(), rounding);
}

TEST(Attitude, MatrixAndBack) {
  std::mt19937_64 random(2);  // seed 2
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 100; ++i) {
    const Attitude a{3.1 * uniform(random), 1.5 * uniform(random), 3.1 * uniform(random)};
    const Attitude b = attitude_from_matrix(attitude_matrix(a));
    // Roll and heading divide by cos(pitch) >= cos 1.5 = 0.07.
    EXPECT_NEAR(b.roll, a.roll, rounding / 0.07);
    EXPECT_NEAR(b.pitch, a.pitch, rounding);
    EXPECT_NEAR(b.heading, a.heading, rounding / 0.07);
  }
  for (const double pitch : {quarter, -quarter}) {
    const Matrix3 C = attitude_matrix({0.4, pitch, 1.1});
    EXPECT_LT((attitude_matrix(attitude_from_matrix(C)) - C).norm(), rounding);
  }
}

}  // namespace
}  // namespace selfcal
