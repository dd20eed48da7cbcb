#include "estimator/models/segments.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

constexpr double window_s = 0.25;
constexpr double shortest_s = 1.0;
// The read-out of a standing gimbal scatters by arcseconds: 0.2 deg/s over a window is 3 arcmin.
constexpr double gimbal_threshold = 0.2 * units::degree;      // rad/s
constexpr double gyro_threshold_least = 1.0 * units::degree;  // rad/s

// Difference of two angles, to within half a turn.
double angle_between(double a, double b) { return std::remainder(a - b, 360.0 * units::degree); }

struct Window {
  std::size_t first, last;
  double rate;  // rad/s, mean over the window
};

std::vector<Window> windows_of(const ImuData& data, bool by_gimbal) {
  std::vector<Window> windows;
  const std::size_t n = data.size();
  const auto step = static_cast<std::size_t>(std::max(1.0, std::round(window_s * data.sample_rate_hz)));
  for (std::size_t first = 0; first < n; first += step) {
    const std::size_t last = std::min(n, first + step);
    const double duration = static_cast<double>(last - first) / data.sample_rate_hz;
    double turn = 0.0;
    if (by_gimbal) {
      const std::size_t end = std::min(last, n - 1);
      turn = std::hypot(angle_between(data.gimbal_outer[end], data.gimbal_outer[first]),
                        angle_between(data.gimbal_inner[end], data.gimbal_inner[first]));
    } else {
      Vector3 sum = Vector3::Zero();
      for (std::size_t i = first; i < last; ++i) {
        sum += Eigen::Map<const Vector3>(data.delta_theta[i].data());
      }
      turn = sum.norm();
    }
    windows.push_back({first, last, turn / duration});
  }
  return windows;
}

double threshold_of(const std::vector<Window>& windows, bool by_gimbal) {
  if (by_gimbal) {
    return gimbal_threshold;
  }
  double fastest = 0.0;
  for (const Window& w : windows) {
    fastest = std::max(fastest, w.rate);
  }
  return std::max(gyro_threshold_least, 0.25 * fastest);
}

void describe(const ImuData& data, bool by_gimbal, Segment& segment) {
  segment.start_s = segment.first == 0 ? data.time_s[0] - 1.0 / data.sample_rate_hz : data.time_s[segment.first - 1];
  segment.end_s = data.time_s[segment.last - 1];
  if (by_gimbal && !segment.rotation) {
    const double outer = data.gimbal_outer[segment.first];
    const double inner = data.gimbal_inner[segment.first];
    double outer_sum = 0.0;
    double inner_sum = 0.0;
    for (std::size_t i = segment.first; i < segment.last; ++i) {
      outer_sum += angle_between(data.gimbal_outer[i], outer);
      inner_sum += angle_between(data.gimbal_inner[i], inner);
    }
    const auto count = static_cast<double>(segment.last - segment.first);
    segment.outer = outer + outer_sum / count;
    segment.inner = inner + inner_sum / count;
  }
}

}  // namespace

std::vector<Segment> find_segments(const ImuData& data) {
  std::vector<Segment> segments;
  if (data.size() == 0) {
    return segments;
  }
  const bool by_gimbal = data.gimbal_outer.size() == data.size() && data.gimbal_inner.size() == data.size();
  const std::vector<Window> windows = windows_of(data, by_gimbal);
  const double threshold = threshold_of(windows, by_gimbal);
  for (const Window& window : windows) {
    const bool rotation = window.rate > threshold;
    if (segments.empty() || segments.back().rotation != rotation) {
      segments.push_back({rotation, window.first, window.last, 0.0, 0.0, 0.0, 0.0});
    } else {
      segments.back().last = window.last;
    }
  }
  const auto shortest = static_cast<std::size_t>(shortest_s * data.sample_rate_hz);
  std::vector<Segment> joined;
  for (const Segment& segment : segments) {
    const bool is_short = segment.last - segment.first < shortest;
    if (!joined.empty() && (is_short || joined.back().rotation == segment.rotation)) {
      joined.back().last = segment.last;
    } else {
      joined.push_back(segment);
    }
  }
  for (Segment& segment : joined) {
    describe(data, by_gimbal, segment);
  }
  return joined;
}

std::vector<Segment> observed(const std::vector<Segment>& segments, const ImuData& data) {
  std::vector<Segment> pieces;
  for (const Segment& segment : segments) {
    Segment rest = segment;
    for (const Coast& coast : data.coasts) {
      if (coast.last <= rest.first || coast.first >= rest.last) {
        continue;
      }
      if (coast.first > rest.first) {
        Segment piece = rest;
        piece.last = coast.first;
        piece.end_s = data.time_s[coast.first - 1];
        pieces.push_back(piece);
      }
      rest.first = std::min(coast.last, rest.last);
      rest.start_s = data.time_s[rest.first - 1];
    }
    if (rest.first < rest.last) {
      pieces.push_back(rest);
    }
  }
  return pieces;
}

}  // namespace selfcal
