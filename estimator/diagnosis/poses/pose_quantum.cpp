#include "estimator/diagnosis/poses/pose_quantum.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "estimator/geometry/units.hpp"

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

double silent_band(const std::vector<std::array<double, 3>>& series, std::size_t axis, const std::vector<Pose>& poses) {
  if (poses.empty()) {
    return 0.0;
  }
  const double value = series[poses.front().first][axis];
  for (const Pose& p : poses) {
    for (const auto& [first, last] : p.quiet) {
      for (std::size_t i = first; i < last; ++i) {
        if (series[i][axis] != value) {
          return 0.0;
        }
      }
    }
  }
  double nearest = HUGE_VAL;
  for (const std::array<double, 3>& row : series) {
    nearest = row[axis] == value ? nearest : std::min(nearest, std::abs(row[axis] - value));
  }
  return nearest;
}

double hidden_by_band(double band, double quantum) {
  constexpr double quanta = 2.0;
  return band > quanta * quantum ? band / std::sqrt(3.0) : quantum * hidden_by_quantum(0.0);
}

std::string silent_gyros(const PoseInput& input, const std::vector<Pose>& poses) {
  std::string axes;
  double widest = 0.0;
  for (std::size_t axis = 0; axis < 3 && input.sensors != Sensors::accelerometers; ++axis) {
    const double band = input.gyro_axes[axis] ? silent_band(input.gyro, axis, poses) : 0.0;
    if (band > 0.0) {
      axes += (axes.empty() ? "" : ", ") + std::string(1, "xyz"[axis]);
      widest = std::max(widest, band);
    }
  }
  if (axes.empty()) {
    return axes;
  }
  std::array<char, 120> within{};
  if (std::isfinite(widest) && input.gyros_si) {
    std::snprintf(within.data(), within.size(), ": within %.2g deg/s of it", widest / units::degree);
  } else if (std::isfinite(widest)) {
    std::snprintf(within.data(), within.size(), ": within %.2g raw units of it", widest);
  } else {
    std::snprintf(within.data(), within.size(), ": how near to it nothing says");
  }
  return "bias of gyro " + axes + ", which read one value in all rests, as of a device that sets itself to zero" +
         within.data();
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
      const bool gyro = &series == &input.gyro;
      const double band = gyro ? silent_band(series, static_cast<std::size_t>(axis), poses) : 0.0;
      for (Pose& p : poses) {
        (p.*hidden)(axis) = band > 0.0 ? hidden_by_band(band, quantum) : (p.*hidden)(axis);
      }
      for (Pose& p : poses) {
        const auto alike = std::count_if(poses.begin(), poses.end(), [&](const Pose& other) {
          return band > 0.0 || std::abs((other.*mean)(axis) - (p.*mean)(axis)) < 0.5 * quantum;
        });
        (p.*hidden)(axis) *= std::sqrt(static_cast<double>(std::max<std::ptrdiff_t>(1, alike)));
      }
    }
  };
  fill(input.gyro, &Pose::gyro, &Pose::gyro_white, &Pose::gyro_hidden);
  fill(input.accel, &Pose::accel, &Pose::accel_white, &Pose::accel_hidden);
}

}  // namespace selfcal::diagnosis
