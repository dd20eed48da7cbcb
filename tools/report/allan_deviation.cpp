#include "tools/report/allan_deviation.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::report {
namespace {

using Six = std::array<double, 6>;

constexpr double clusters_per_decade = 10.0;
constexpr std::size_t settling_s = 1;  // after a turn; the gimbal comes to rest

// Running integrals of one dwell; integral[k] covers its first k samples.
std::vector<Six> integrate(const Recording& recording, std::size_t first, std::size_t last) {
  std::vector<Six> integral(last - first + 1, Six{});
  for (std::size_t row = first; row < last; ++row) {
    const Six& before = integral[row - first];
    Six& after = integral[row - first + 1];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      after[axis] = before[axis] + recording.delta_theta_rad[row][axis];
      after[axis + 3] = before[axis + 3] + recording.delta_v_mps[row][axis];
    }
  }
  return integral;
}

// Adds the squared second differences over m samples.
void add_differences(const std::vector<Six>& integral, std::size_t m, Six& sum, std::size_t& count) {
  for (std::size_t k = 0; k + 2 * m < integral.size(); ++k) {
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const double d = integral[k + 2 * m][axis] - 2.0 * integral[k + m][axis] + integral[k][axis];
      sum[axis] += d * d;
    }
    ++count;
  }
}

// Of the variance over m samples from one dwell of `points` integrals, overlapping estimator: the lesser of those for
// white noise (white FM) and for a rate random walk (random-walk FM).
double freedom_of(double points, double m) {
  const double white = (1.5 * (points - 1.0) / m - 2.0 * (points - 2.0) / points) * 4.0 * m * m / (4.0 * m * m + 5.0);
  const double n = points - 1.0;
  const double walk = (points - 2.0) / m * (n * n - 3.0 * m * n + 4.0 * m * m) / ((points - 3.0) * (points - 3.0));
  return std::max(1.0, std::min(white, walk));
}

// Of the mean over all differences: each dwell weighs as many as it has.
double pooled_freedom(const std::vector<std::vector<Six>>& integrals, std::size_t m) {
  double count = 0.0;
  double variance = 0.0;
  for (const auto& integral : integrals) {
    if (integral.size() > 2 * m) {
      const auto differences = static_cast<double>(integral.size() - 2 * m);
      count += differences;
      variance += differences * differences / freedom_of(static_cast<double>(integral.size()), static_cast<double>(m));
    }
  }
  return variance > 0.0 ? count * count / variance : 0.0;
}

std::vector<std::size_t> cluster_lengths(std::size_t longest) {
  std::vector<std::size_t> lengths;
  for (double step = 0.0;; step += 1.0) {
    const auto m = static_cast<std::size_t>(std::lround(std::pow(10.0, step / clusters_per_decade)));
    if (m > longest) {
      return lengths;
    }
    if (lengths.empty() || m > lengths.back()) {
      lengths.push_back(m);
    }
  }
}

}  // namespace

std::vector<AllanPoint> allan_deviation(const Recording& recording, const std::vector<Segment>& segments) {
  const auto settling = static_cast<std::size_t>(static_cast<double>(settling_s) * recording.sample_rate_hz);
  std::vector<std::vector<Six>> integrals;
  std::size_t longest = 0;
  for (const Segment& segment : segments) {
    if (!segment.rotation && segment.last > segment.first + 2 * settling) {
      integrals.push_back(integrate(recording, segment.first + settling, segment.last - settling));
      longest = std::max(longest, integrals.back().size() - 1);
    }
  }
  std::vector<AllanPoint> points;
  for (const std::size_t m : cluster_lengths(longest / 3)) {
    AllanPoint point;
    point.tau_s = static_cast<double>(m) / recording.sample_rate_hz;
    for (const auto& integral : integrals) {
      add_differences(integral, m, point.deviation, point.differences);
    }
    if (point.differences == 0) {
      continue;
    }
    for (double& value : point.deviation) {
      value = std::sqrt(value / (2.0 * static_cast<double>(point.differences))) / point.tau_s;
    }
    point.freedom = pooled_freedom(integrals, m);
    points.push_back(point);
  }
  return points;
}

}  // namespace selfcal::report
