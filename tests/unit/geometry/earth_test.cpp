// The Earth against GeographicLib 2.1 (C. Karney), which shares no formula with ours: normal gravity from the closed
// potential of the level ellipsoid, curvature radii, and rotations of n from its ECEF frames.
#include <gtest/gtest.h>

#include <GeographicLib/Ellipsoid.hpp>
#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/NormalGravity.hpp>
#include <cmath>
#include <vector>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::earth {
namespace {

std::vector<double> latitudes_deg() {
  std::vector<double> all;
  for (int degrees = -90; degrees <= 90; degrees += 5) {
    all.push_back(degrees);
  }
  return all;
}

// Columns are north, up, east at the place, in ECEF.
Matrix3 frame_en(double latitude_deg, double longitude_deg, double height, Vector3* position = nullptr) {
  std::vector<double> M(9);  // row-major, columns east, north, up
  double x = 0.0, y = 0.0, z = 0.0;
  GeographicLib::Geocentric::WGS84().Forward(latitude_deg, longitude_deg, height, x, y, z, M);
  if (position != nullptr) {
    *position = {x, y, z};
  }
  Matrix3 C_en;
  C_en << M[1], M[2], M[0], M[4], M[5], M[3], M[7], M[8], M[6];
  return C_en;
}

// Somigliana's formula is exact; what remains is the rounding of the published gamma_e (5e-11 m/s^2) and k (5e-15 of
// 10 m/s^2).
TEST(NormalGravity, OnTheEllipsoid) {
  for (const double latitude : latitudes_deg()) {
    const double exact = GeographicLib::NormalGravity::WGS84().SurfaceGravity(latitude);
    EXPECT_NEAR(normal_gravity(latitude * units::degree, 0.0), exact, 1e-10) << latitude;
  }
}

double exact_gravity(double latitude_deg, double height) {
  double north = 0.0, up = 0.0;
  GeographicLib::NormalGravity::WGS84().Gravity(latitude_deg, height, north, up);
  return std::hypot(north, up);
}

// What the expansion in height leaves out, with x = h/a: of the gradient, which is exactly gamma (1/R_M + 1/R_N) +
// 2 omega^2 (Bruns), 3 (f^2 + m^2) x at the equator and less elsewhere, m^2 < 1.1 f^2; of the second coefficient, 3 x^2,
// curvatures differing by 2 f each way, at most 12 f x^2; and the next term, 4 x^3. At 9 km 2e-6 m/s^2 at most.
double height_bound(double height) {
  const double x = std::abs(height) / semi_major_axis;
  return 1e-10 + 9.9 * (6.3 * flattening * flattening * x + 12.0 * flattening * x * x + 4.0 * x * x * x);
}

TEST(NormalGravity, AboveAndBelowTheEllipsoid) {
  for (const double latitude : latitudes_deg()) {
    for (const double height : {-400.0, 50.0, 1000.0, 5000.0, 9000.0}) {
      EXPECT_NEAR(normal_gravity(latitude * units::degree, height), exact_gravity(latitude, height),
                  height_bound(height))
          << latitude << " deg, " << height << " m";
    }
    EXPECT_LT(std::abs(normal_gravity(latitude * units::degree, 10000.0) - exact_gravity(latitude, 10000.0)), 1e-6)
        << "the header's promise, " << latitude << " deg";
  }
}

// The derivative of the bound above, 2 g/a = 3.1e-6 1/s^2 being the gradient. Central difference over 2 d: third
// derivative 24 g/a^3 times d^2/6 = 2e-15, rounding 2e-15/d.
TEST(NormalGravity, Gradient) {
  constexpr double d = 100.0;  // m
  for (const double latitude : latitudes_deg()) {
    for (const double height : {0.0, 1000.0}) {
      const double exact = (exact_gravity(latitude, height + d) - exact_gravity(latitude, height - d)) / (2.0 * d);
      const double x = height / semi_major_axis;
      const double bound =
          9.9 / semi_major_axis * (6.3 * flattening * flattening + 24.0 * flattening * x + 12.0 * x * x);
      EXPECT_NEAR(gravity_gradient(latitude * units::degree, height), exact, bound + 1e-14) << latitude;
    }
  }
}

// A dozen operations on numbers of 6e6 m round by 1e-15 each of it.
TEST(Radii, OfCurvature) {
  const GeographicLib::Ellipsoid& wgs84 = GeographicLib::Ellipsoid::WGS84();
  for (const double latitude : latitudes_deg()) {
    EXPECT_NEAR(meridian_radius(latitude * units::degree), wgs84.MeridionalCurvatureRadius(latitude), 1e-7);
    EXPECT_NEAR(prime_vertical_radius(latitude * units::degree), wgs84.TransverseCurvatureRadius(latitude), 1e-7);
  }
}

// A small step in latitude moves by (R_M + h) dL, one in longitude by (R_N + h) cos L dlambda. Central differences of
// ECEF positions: relative error s^2/6 = 2e-9 for s = 1e-4 rad, rounding 1e-9 m / 1e-4 = 1e-5 m of 6e6 m.
TEST(Radii, MovePositionsInEcef) {
  constexpr double s = 1e-4;  // rad
  for (double latitude = -80.0; latitude <= 80.0; latitude += 20.0) {
    constexpr double longitude = 116.0, height = 800.0;
    const double L = latitude * units::degree;
    const Matrix3 C_en = frame_en(latitude, longitude, height);
    const auto difference = [&](double d_latitude, double d_longitude) -> Vector3 {
      Vector3 ahead, behind;
      frame_en(latitude + d_latitude / units::degree, longitude + d_longitude / units::degree, height, &ahead);
      frame_en(latitude - d_latitude / units::degree, longitude - d_longitude / units::degree, height, &behind);
      return C_en.transpose() * (ahead - behind) / (2.0 * s);
    };
    constexpr double bound = 3e-9 * 6.4e6 + 1e-4;  // m per rad
    const Vector3 north(meridian_radius(L) + height, 0.0, 0.0);
    const Vector3 east(0.0, 0.0, (prime_vertical_radius(L) + height) * std::cos(L));
    // The meridian's radius changes along it by 3 e^2 R sin 2L / 2 per rad: in a central difference only as s^2.
    EXPECT_LT((difference(s, 0.0) - north).norm(), bound) << latitude;
    EXPECT_LT((difference(0.0, s) - east).norm(), bound) << latitude;
  }
}

// The axis of the Earth is ECEF's z.
TEST(EarthRate, IsTheAxisOfEcef) {
  for (const double latitude : latitudes_deg()) {
    const Vector3 expected = frame_en(latitude, 30.0, 0.0).transpose() * Vector3(0.0, 0.0, rotation_rate);
    EXPECT_LT((omega_ie_n(latitude * units::degree) - expected).norm(), 1e-15 * rotation_rate * 10.0) << latitude;
  }
}

// n carried over the Earth: its rotation between two places, from ECEF frames. Over s = 1e-4 rad both ways the second
// order cancels; the third leaves s^2 (1 + tan^2 L) of the rate, rounding 1e-16/s.
TEST(TransportRate, IsTheTurnOfEcefFrames) {
  constexpr double s = 1e-4;  // s of time at a speed of about one Earth radius a second
  constexpr double speed = 6.4e6;
  for (double latitude = -80.0; latitude <= 80.0; latitude += 20.0) {
    constexpr double longitude = 10.0, height = 3000.0;
    const double L = latitude * units::degree;
    for (const Vector3& heading : {Vector3(1, 0, 0), Vector3(0, 0, 1), Vector3(0.6, 0, -0.8), Vector3(0, 1, 0)}) {
      const Vector3 v = speed * heading;
      const double dL = v.x() / (meridian_radius(L) + height) * s;
      const double dl = v.z() / ((prime_vertical_radius(L) + height) * std::cos(L)) * s;
      const Matrix3 ahead = frame_en(latitude + dL / units::degree, longitude + dl / units::degree, height);
      const Matrix3 behind = frame_en(latitude - dL / units::degree, longitude - dl / units::degree, height);
      // The turn is seen from the place in the middle: n turns by as much before it as after.
      const Vector3 turn = rotation_vector_from_matrix(behind.transpose() * ahead) / (2.0 * s);
      const double t = std::tan(L);
      const Vector3 rate = omega_en_n({L, longitude * units::degree, height}, v);
      EXPECT_LT((turn - rate).norm(), 2.0 * s * (1.0 + t * t) * rate.norm() + 1e-11)
          << latitude << " " << heading.transpose();
    }
  }
}

}  // namespace
}  // namespace selfcal::earth
