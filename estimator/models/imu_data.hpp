// What the estimator reads: a view of one recording's increments. The owner keeps the memory.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "estimator/geometry/earth.hpp"
#include "estimator/geometry/rotation.hpp"

namespace selfcal {

// Samples that hold no observation, whatever stands in them. The navigation goes on without the accelerometers there and
// starts anew from the site behind them; without the gyros it holds the attitude, or turns it by `turn`.
struct Coast {
  std::size_t first = 0, last = 0;     // samples [first, last)
  bool gyros = false;                  // theirs are lost too
  bool turned = false;                 // and the IMU may have turned meanwhile: the attitude opens
  Matrix3 turn = Matrix3::Identity();  // C_nb behind = C_nb before * turn, as far as it is known
};

// Smallest steps of the increments; 0 where none shows.
struct Quanta {
  double angle = 0.0;     // rad
  double velocity = 0.0;  // m/s
};

struct ImuData {
  earth::Position site;                                // known position of the site
  double sample_rate_hz = 0.0;                         // nominal
  std::span<const double> time_s;                      // [N] end of each interval, strictly increasing
  std::span<const std::array<double, 3>> delta_theta;  // [N] rad, gyro output integrated over the interval, b
  std::span<const std::array<double, 3>> delta_v;      // [N] m/s, accelerometer output integrated, b
  std::span<const double> gimbal_outer;                // [N] rad, may be empty: used to name positions only
  std::span<const double> gimbal_inner;                // [N] rad, may be empty
  std::span<const double> temperature;                 // [N] degC of the first channel, may be empty
  std::span<const Coast> coasts;                       // chronological, no two overlap; mostly empty
  std::optional<Quanta> quanta;  // that the increments had before something was taken out of them; none: they show it

  std::size_t size() const { return time_s.size(); }
};

}  // namespace selfcal
