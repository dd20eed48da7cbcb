#include "estimator/diagnosis/poses/references.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "estimator/diagnosis/poses/pose_data.hpp"
#include "estimator/geometry/rotation.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/statistics/median.hpp"

namespace selfcal::diagnosis {
namespace {

std::string sentence(const char* format, double a, double b) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

// Sigma of the mean rate over the recording, rad/s, were a sample's noise white: by the second differences, which hold no
// motion to speak of. The quietest axis, and of its seconds the quieter half.
double sigma_of_mean_rate(const ImuData& data) {
  const auto window = static_cast<std::size_t>(std::max(4.0, data.sample_rate_hz));
  double best = HUGE_VAL;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> square;
    for (std::size_t first = 0; first + window <= data.size(); first += window) {
      double sum = 0.0;
      for (std::size_t i = first + 2; i < first + window; ++i) {
        const double bend =
            data.delta_theta[i][axis] - 2.0 * data.delta_theta[i - 1][axis] + data.delta_theta[i - 2][axis];
        sum += bend * bend / 6.0;
      }
      square.push_back(sum / static_cast<double>(window - 2));
    }
    if (!square.empty()) {
      best = std::min(best, std::sqrt(median(square)));
    }
  }
  return best * data.sample_rate_hz / std::sqrt(static_cast<double>(data.size()));
}

bool read_outs_rest(const ImuData& data) {
  const auto zero = [](double angle) { return angle == 0.0; };
  return std::all_of(data.gimbal_outer.begin(), data.gimbal_outer.end(), zero) &&
         std::all_of(data.gimbal_inner.begin(), data.gimbal_inner.end(), zero) && !data.gimbal_outer.empty();
}

// The largest angle of gravity in the sensor to where it was at first, by means over a second. rad.
double gravity_turned(const ImuData& data) {
  const auto window = static_cast<std::size_t>(std::max(4.0, data.sample_rate_hz));
  Vector3 start = Vector3::Zero();
  double largest = 0.0;
  for (std::size_t first = 0; first + window <= data.size(); first += window) {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = first; i < first + window; ++i) {
      sum += Eigen::Map<const Vector3>(data.delta_v[i].data());
    }
    if (first == 0) {
      start = sum;
    }
    largest = std::max(largest, std::atan2(start.cross(sum).norm(), start.dot(sum)));
  }
  return largest;
}

// The largest angle that the gyros turn without a second of rest, beside their usual rate. A base that sways turns back. rad.
double gyros_turned(const ImuData& data) {
  const auto window = static_cast<std::size_t>(std::max(4.0, data.sample_rate_hz));
  std::vector<Vector3> turns;  // of a second
  for (std::size_t first = 0; first + window <= data.size(); first += window) {
    turns.emplace_back(Vector3::Zero());
    for (std::size_t i = first; i < first + window; ++i) {
      turns.back() += Eigen::Map<const Vector3>(data.delta_theta[i].data());
    }
  }
  const Vector3 usual = turns.empty() ? Vector3::Zero() : median_of_axes(turns);
  constexpr double rests = 1.0 * units::degree;
  double largest = 0.0;
  Vector3 run = Vector3::Zero();
  for (const Vector3& turn : turns) {
    run = (turn - usual).norm() > rests ? Vector3(run + turn - usual) : Vector3::Zero();
    largest = std::max(largest, run.norm());
  }
  return largest;
}

}  // namespace

PositionReference position_reference(const ImuData& data) {
  constexpr double earth_deg_per_h = 15.041, visible = 0.05, much = 20.0 * units::degree;
  if (data.size() < 4 || data.sample_rate_hz <= 0.0) {
    return {};
  }
  const double sigma = sigma_of_mean_rate(data) / units::degree_per_hour;
  if (std::isfinite(sigma) && sigma > visible * earth_deg_per_h) {
    return {false, sentence("the gyros' noise leaves %.2g deg/h of the mean rate over the recording, too much to see "
                            "the Earth's %.3g by",
                            sigma, earth_deg_per_h)};
  }
  const double turned = gravity_turned(data);
  if (turned > much && read_outs_rest(data)) {
    return {false, sentence("gravity turns by %.0f deg in the sensor and no read-out leaves %.0f: a hand moved it",
                            turned / units::degree, 0.0)};
  }
  constexpr double about_up = 30.0 * units::degree;
  if (const double heading = gyros_turned(data); heading > about_up && read_outs_rest(data)) {
    return {false, sentence("the gyros turn by %.0f deg at once and no read-out leaves %.0f: a hand moved it",
                            heading / units::degree, 0.0)};
  }
  return {};
}

}  // namespace selfcal::diagnosis
