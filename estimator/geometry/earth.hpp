// The Earth: WGS-84 ellipsoid, rotation, normal gravity. SI and radians; navigation frame n = north, up, east.
// Source: NIMA TR8350.2, 3rd ed. (2000): defining constants and section 4 (normal gravity).
#pragma once

#include "estimator/geometry/rotation.hpp"

namespace selfcal::earth {

inline constexpr double semi_major_axis = 6378137.0;  // m
inline constexpr double flattening = 1.0 / 298.257223563;
inline constexpr double rotation_rate = 7.292115e-5;  // rad/s
inline constexpr double eccentricity_squared = flattening * (2.0 - flattening);

// Site: geodetic latitude and longitude in rad, ellipsoidal height in m.
struct Position {
  double latitude = 0.0;
  double longitude = 0.0;
  double height = 0.0;
};

double meridian_radius(double latitude);        // R_M, m
double prime_vertical_radius(double latitude);  // R_N, m

// Normal gravity (gravitation plus centrifugal), m/s^2, positive downwards: Somigliana's closed formula, and the
// second-order expansion in height; below 10 km height within 1e-6 m/s^2 of the exact field.
double normal_gravity(double latitude, double height);
// d(normal_gravity)/d(height), 1/s^2, negative.
double gravity_gradient(double latitude, double height);

// Earth's rotation seen in n, rad/s: (Omega cos L, Omega sin L, 0).
Vector3 omega_ie_n(double latitude);
// Rotation of n over the Earth, rad/s, for v_en_n = (north, up, east) in m/s:
// (v_e/(R_N+h), v_e tan L/(R_N+h), -v_n/(R_M+h)).
Vector3 omega_en_n(const Position& position, const Vector3& v_en_n);

}  // namespace selfcal::earth
