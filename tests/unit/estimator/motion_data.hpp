// Increments made in a test, and the view of them that the estimator reads.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "estimator/models/imu_data.hpp"

namespace selfcal::test {

// Exact or nearly exact increments of rate and specific force in b, from functions of time.
class MotionData {
 public:
  // `angle` and `velocity`: integrals over [begin, end], rad and m/s.
  using Integral = std::function<Vector3(double begin, double end)>;

  MotionData(const earth::Position& site, double rate_hz, double length_s, const Integral& angle,
             const Integral& velocity) {
    view_.site = site;
    view_.sample_rate_hz = rate_hz;
    const auto count = static_cast<std::size_t>(std::lround(length_s * rate_hz));
    for (std::size_t i = 0; i < count; ++i) {
      const double begin = static_cast<double>(i) / rate_hz;
      const double end = static_cast<double>(i + 1) / rate_hz;
      const Vector3 a = angle(begin, end);
      const Vector3 u = velocity(begin, end);
      time_s_.push_back(end);
      delta_theta_.push_back({a.x(), a.y(), a.z()});
      delta_v_.push_back({u.x(), u.y(), u.z()});
    }
    view_.time_s = time_s_;
    view_.delta_theta = delta_theta_;
    view_.delta_v = delta_v_;
  }
  MotionData(const MotionData&) = delete;
  MotionData& operator=(const MotionData&) = delete;

  const ImuData& view() const { return view_; }

 private:
  std::vector<double> time_s_;
  std::vector<std::array<double, 3>> delta_theta_, delta_v_;
  ImuData view_;
};

}  // namespace selfcal::test
