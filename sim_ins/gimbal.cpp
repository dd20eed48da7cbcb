#include "sim_ins/gimbal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/geometry/units.hpp"

namespace selfcal::sim {
namespace {

using std::numbers::pi;

// Fraction of the move's way, and its first and second derivative in time. With peak rate P = 1/(T - r), r the ramp:
// rate rises as P/2 (1 - cos(pi t/r)), which covers P r/2 like a straight ramp would.
std::array<double, 3> profile(double t, double duration, double ramp) {
  const double peak = 1.0 / (duration - ramp);
  const auto rise = [&](double s) {
    return std::array<double, 3>{0.5 * peak * (s - ramp / pi * std::sin(pi * s / ramp)),
                                 0.5 * peak * (1.0 - std::cos(pi * s / ramp)),
                                 0.5 * peak * pi / ramp * std::sin(pi * s / ramp)};
  };
  if (t <= 0.0) {
    return {0.0, 0.0, 0.0};
  }
  if (t >= duration) {
    return {1.0, 0.0, 0.0};
  }
  if (t < ramp) {
    return rise(t);
  }
  if (t > duration - ramp) {
    const auto mirrored = rise(duration - t);
    return {1.0 - mirrored[0], mirrored[1], -mirrored[2]};
  }
  return {peak * (t - 0.5 * ramp), peak, 0.0};
}

}  // namespace

GimbalMotion::GimbalMotion(std::array<double, 2> initial, std::vector<GimbalMove> moves)
    : initial_(initial), moves_(std::move(moves)) {
  for (const GimbalMove& move : moves_) {
    breakpoints_.insert(breakpoints_.end(),
                        {move.start_s, move.start_s + move.ramp_s, move.end_s() - move.ramp_s, move.end_s()});
  }
}

int GimbalMotion::last_move(double t) const {
  const auto after = std::upper_bound(moves_.begin(), moves_.end(), t,
                                      [](double time, const GimbalMove& move) { return time < move.start_s; });
  return static_cast<int>(after - moves_.begin()) - 1;
}

GimbalState GimbalMotion::at(double t) const {
  const int k = last_move(t);
  GimbalState state;
  if (k < 0) {
    state.angle = initial_;
    return state;
  }
  const GimbalMove& move = moves_[static_cast<std::size_t>(k)];
  const auto way = profile(t - move.start_s, move.duration_s, move.ramp_s);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double distance = move.to[axis] - move.from[axis];
    state.angle[axis] = move.from[axis] + distance * way[0];
    state.rate[axis] = distance * way[1];
    state.acceleration[axis] = distance * way[2];
  }
  return state;
}

bool GimbalMotion::turning(double begin, double end) const {
  const int k = last_move(end);
  return k >= 0 && begin < moves_[static_cast<std::size_t>(k)].end_s();
}

double GimbalMotion::since_move_end(double t) const {
  for (int k = last_move(t); k >= 0; --k) {
    const double since = t - moves_[static_cast<std::size_t>(k)].end_s();
    if (since >= 0.0) {
      return since;
    }
  }
  return -1.0;
}

double ramp_time(const GimbalConfig& config, double duration_s) { return std::min(config.ramp_s, duration_s / 2.0); }

Expected<void> check_schedule(const GimbalConfig& config, const Schedule& schedule) {
  if (schedule.positions.empty() || schedule.dwell_s.size() != schedule.positions.size()) {
    return fail(ErrorKind::bad_input, fmt::format("schedule: {} positions with {} dwell times",
                                                  schedule.positions.size(), schedule.dwell_s.size()));
  }
  const double ramp = ramp_time(config, schedule.rotation_s);
  for (std::size_t k = 1; k < schedule.positions.size(); ++k) {
    const GimbalPosition& from = schedule.positions[k - 1];
    const GimbalPosition& to = schedule.positions[k];
    const double distance = std::max(std::abs(to.outer_deg - from.outer_deg), std::abs(to.inner_deg - from.inner_deg));
    if (distance > 0.0 && !(schedule.rotation_s > 0.0)) {
      return fail(ErrorKind::bad_input, fmt::format("schedule: rotation_s = {} s", schedule.rotation_s));
    }
    const double rate = distance > 0.0 ? distance / (schedule.rotation_s - ramp) : 0.0;
    const double acceleration = distance > 0.0 ? rate * pi / (2.0 * ramp) : 0.0;
    if (rate > config.max_rate_deg_per_s || acceleration > config.max_acceleration_deg_per_s2) {
      return fail(ErrorKind::bad_input,
                  fmt::format("schedule: move {} of {} deg in {} s needs {:.1f} deg/s and {:.1f} deg/s^2, the gimbal "
                              "has {} deg/s and {} deg/s^2",
                              k, distance, schedule.rotation_s, rate, acceleration, config.max_rate_deg_per_s,
                              config.max_acceleration_deg_per_s2));
    }
  }
  return {};
}

GimbalMotion plan_gimbal(const GimbalConfig& config, const Schedule& schedule, Random& random) {
  const auto reached = [&](const GimbalPosition& wanted) {
    const double e = config.positioning_error_deg;
    const double outer = wanted.outer_deg + random.uniform(-e, e);
    const double inner = wanted.inner_deg + random.uniform(-e, e);
    return std::array<double, 2>{outer * units::degree, inner * units::degree};
  };
  const std::array<double, 2> initial = reached(schedule.positions.front());
  std::array<double, 2> angle = initial;
  std::vector<GimbalMove> moves;
  double t = schedule.dwell_s.front();
  for (std::size_t k = 1; k < schedule.positions.size(); ++k) {
    const auto to = reached(schedule.positions[k]);
    moves.push_back({t, schedule.rotation_s, ramp_time(config, schedule.rotation_s), angle, to});
    t += schedule.rotation_s + schedule.dwell_s[k];
    angle = to;
  }
  return {initial, std::move(moves)};
}

}  // namespace selfcal::sim
