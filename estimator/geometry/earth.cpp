#include "estimator/geometry/earth.hpp"

#include <cmath>

namespace selfcal::earth {
namespace {

constexpr double gravity_equator = 9.7803253359;      // m/s^2, gamma_e
constexpr double somigliana_k = 0.00193185265241;     // (b gamma_p)/(a gamma_e) - 1
constexpr double gravity_ratio_m = 0.00344978650684;  // omega^2 a^2 b / GM

struct HeightExpansion {  // gamma(h) = gamma_0 (1 + first h + second h^2), TR8350.2 eq. (4-3)
  double surface;
  double first;
  double second;
};

HeightExpansion height_expansion(double latitude) {
  const double s2 = std::sin(latitude) * std::sin(latitude);
  return {gravity_equator * (1.0 + somigliana_k * s2) / std::sqrt(1.0 - eccentricity_squared * s2),
          -2.0 / semi_major_axis * (1.0 + flattening + gravity_ratio_m - 2.0 * flattening * s2),
          3.0 / (semi_major_axis * semi_major_axis)};
}

}  // namespace

double meridian_radius(double latitude) {
  const double s = std::sin(latitude);
  const double w2 = 1.0 - eccentricity_squared * s * s;
  return semi_major_axis * (1.0 - eccentricity_squared) / (w2 * std::sqrt(w2));
}

double prime_vertical_radius(double latitude) {
  const double s = std::sin(latitude);
  return semi_major_axis / std::sqrt(1.0 - eccentricity_squared * s * s);
}

double normal_gravity(double latitude, double height) {
  const HeightExpansion g = height_expansion(latitude);
  return g.surface * (1.0 + height * (g.first + height * g.second));
}

double gravity_gradient(double latitude, double height) {
  const HeightExpansion g = height_expansion(latitude);
  return g.surface * (g.first + 2.0 * height * g.second);
}

Vector3 omega_ie_n(double latitude) {
  return {rotation_rate * std::cos(latitude), rotation_rate * std::sin(latitude), 0.0};
}

Vector3 omega_en_n(const Position& position, const Vector3& v_en_n) {
  const double north_radius = meridian_radius(position.latitude) + position.height;
  const double east_radius = prime_vertical_radius(position.latitude) + position.height;
  return {v_en_n.z() / east_radius, v_en_n.z() * std::tan(position.latitude) / east_radius, -v_en_n.x() / north_radius};
}

}  // namespace selfcal::earth
