#include "estimator/diagnosis/poses/pose_quantum.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {

double quantum_of(const std::vector<std::array<double, 3>>& series, std::size_t axis, std::size_t first,
                  std::size_t last) {
  constexpr double rounding = 1e-6;  // of the largest step
  double most = 0.0, least = HUGE_VAL;
  for (std::size_t i = first + 1; i < last; ++i) {
    most = std::max(most, std::abs(series[i][axis] - series[i - 1][axis]));
  }
  for (std::size_t i = first + 1; i < last; ++i) {
    const double step = std::abs(series[i][axis] - series[i - 1][axis]);
    least = step > rounding * most ? std::min(least, step) : least;
  }
  return most > 0.0 ? least : 0.0;
}

double hidden_by_quantum(double variance) {
  constexpr double of_rounding = 1.0 / 12.0;
  constexpr int terms = 20;
  const double noise = std::max(0.0, variance - of_rounding);
  double square = 0.0;
  for (int k = 1; k <= terms; ++k) {
    square += std::exp(-4.0 * M_PI * M_PI * k * k * noise) / (2.0 * M_PI * M_PI * k * k);
  }
  return std::sqrt(square);
}

void add_hidden(const PoseInput& input, std::vector<Pose>& poses) {
  const auto fill = [&](const std::vector<std::array<double, 3>>& series, Vector3 Pose::*mean, Vector3 Pose::*white,
                        Vector3 Pose::*hidden) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double quantum = quantum_of(series, static_cast<std::size_t>(axis), 0, series.size());
      for (Pose& p : poses) {
        double samples = 0.0;
        for (const auto& [first, last] : p.quiet) {
          samples += static_cast<double>(last - first);
        }
        const double sigma = (p.*white)(axis)*std::sqrt(samples);
        (p.*hidden)(axis) = quantum > 0.0 ? quantum * hidden_by_quantum(sigma * sigma / (quantum * quantum)) : 0.0;
      }
      for (Pose& p : poses) {
        const auto alike = std::count_if(poses.begin(), poses.end(), [&](const Pose& other) {
          return std::abs((other.*mean)(axis) - (p.*mean)(axis)) < 0.5 * quantum;
        });
        (p.*hidden)(axis) *= std::sqrt(static_cast<double>(std::max<std::ptrdiff_t>(1, alike)));
      }
    }
  };
  fill(input.gyro, &Pose::gyro, &Pose::gyro_white, &Pose::gyro_hidden);
  fill(input.accel, &Pose::accel, &Pose::accel_white, &Pose::accel_hidden);
}

}  // namespace selfcal::diagnosis
