#include "estimator/diagnosis/poses/pose_noise.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {

std::vector<RestNoise> noise_at_rest(const PoseInput& input, const std::vector<std::array<double, 3>>& series,
                                     const std::vector<Pose>& poses) {
  const double rate_hz = sample_rate(input);
  std::size_t longest = 0;
  for (const Pose& p : poses) {
    for (const auto& [first, last] : p.quiet) {
      longest = std::max(longest, last - first);
    }
  }
  std::vector<RestNoise> all;
  for (double tau_s = std::max(1.0, 1.0 / rate_hz);; tau_s *= 2.0) {
    const auto m = static_cast<std::size_t>(std::lround(tau_s * rate_hz));
    if (m == 0 || 3 * m > longest) {
      return all;
    }
    Vector3 square = Vector3::Zero();
    RestNoise noise{static_cast<double>(m) / rate_hz, {}, 0.0};
    double count = 0.0;
    for (const Pose& p : poses) {
      for (const auto& [first, last] : p.quiet) {
        if (last - first < 2 * m) {
          continue;
        }
        Vector3 difference = Vector3::Zero();  // of the sums of the m samples from i + m and from i
        for (std::size_t k = first; k < first + m; ++k) {
          difference += at(series, k + m) - at(series, k);
        }
        for (std::size_t i = first;; ++i) {
          square += difference.cwiseAbs2();
          count += 1.0;
          if (i + 2 * m >= last) {
            break;
          }
          difference += at(series, i) - 2.0 * at(series, i + m) + at(series, i + 2 * m);
        }
        noise.freedom += std::floor(static_cast<double>(last - first) / static_cast<double>(m)) - 1.0;
      }
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      noise.deviation[static_cast<std::size_t>(axis)] = std::sqrt(0.5 * square(axis) / count) / static_cast<double>(m);
    }
    all.push_back(noise);
  }
}

}  // namespace selfcal::diagnosis
