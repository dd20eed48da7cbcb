#include "estimator/diagnosis/turn_ramp.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/geometry/rotation.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double never_steady = 0.5;

// Rates of a turn by the gyros, means over stretches short beside its ramps and long beside the noise of a sample.
std::vector<double> rates_of(const ImuData& data, const Segment& turn) {
  constexpr double stretch_s = 0.1;
  const auto step = static_cast<std::size_t>(std::max(1.0, std::round(stretch_s * data.sample_rate_hz)));
  std::vector<double> rates;
  for (std::size_t first = turn.first; first + step <= turn.last; first += step) {
    Vector3 angle = Vector3::Zero();
    for (std::size_t i = first; i < first + step; ++i) {
      angle += Eigen::Map<const Vector3>(data.delta_theta[i].data());
    }
    rates.push_back(angle.norm() * data.sample_rate_hz / static_cast<double>(step));
  }
  return rates;
}

double ramp_of(std::vector<double> rates) {
  constexpr double below_peak = 0.95;  // of the rates: a single one may be noise
  double sum = 0.0, square = 0.0;
  for (const double rate : rates) {
    sum += rate;
    square += rate * rate;
  }
  const auto peak = rates.begin() + static_cast<std::ptrdiff_t>(below_peak * static_cast<double>(rates.size() - 1));
  std::ranges::nth_element(rates, peak);
  const double q = std::min(1.0, square / (*peak * sum));
  return std::min(never_steady, (1.0 - q) / (1.25 - q));
}

}  // namespace

double turn_ramp(const ImuData& data) {
  constexpr std::size_t fewest_rates = 10;
  std::vector<double> ramps;
  for (const Segment& segment : find_segments(data)) {
    if (segment.rotation) {
      const std::vector<double> rates = rates_of(data, segment);
      if (rates.size() >= fewest_rates) {
        ramps.push_back(ramp_of(rates));
      }
    }
  }
  if (ramps.empty()) {
    return never_steady;
  }
  const auto middle = ramps.begin() + static_cast<std::ptrdiff_t>(ramps.size() / 2);
  std::ranges::nth_element(ramps, middle);
  return *middle;
}

}  // namespace selfcal::diagnosis
