// What the texts of an answer by poses share.
#pragma once

#include <fmt/format.h>

#include <string>

#include "estimator/diagnosis/poses/poses.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::cli {

// Readings in a unit that people know.
struct ReadingUnits {
  double gyro = 1.0, accel = 1.0;
  const char *gyro_name = "raw units", *accel_name = "raw units";
  const char *gyro_short = "raw", *accel_short = "raw";
};

inline ReadingUnits units_of(bool si) {
  return si ? ReadingUnits{units::degree, 9.80665e-3, "deg/s", "mg", "deg/s", "mg"} : ReadingUnits{};
}

// The sensor axis that the table's axis mostly turns.
inline Eigen::Index main_axis(const diagnosis::ReadOutAxis& a) {
  Eigen::Index k = 0;
  a.response.cwiseAbs().maxCoeff(&k);
  return k;
}

// What the gyros read of a turn that is positive about their main axis.
inline Vector3 across(const diagnosis::ReadOutAxis& a) {
  return a.response(main_axis(a)) < 0.0 ? Vector3(-a.response) : a.response;
}

// Of turns whose neighbours are off alike.
inline std::string turns_alike_words(const diagnosis::ReadOutAxis& a) {
  return fmt::format("single turns differ by {:.1f} %, neighbours alike ({:.2f}): no mean of these is better known",
                     100.0 * a.turn_scatter, a.turns_alike);
}

}  // namespace selfcal::cli
