#include "estimator/discovery/plan_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

namespace selfcal::discovery {
namespace {

constexpr std::array<double, 3> dwells_s = {60.0, 100.0, 150.0};
constexpr std::array<double, 5> lengths = {0.1, 0.2, 0.4, 0.7, 1.0};  // of the longest rotation
constexpr std::array<double, 3> turn_times = {1.0, 2.0, 4.0};         // of the shortest that the gimbal makes
constexpr std::size_t fewest_positions = 3;
constexpr int drawn_plans = 9;
constexpr int changes = 45;
constexpr double enough = 0.9;         // of what could be gained
constexpr double worth_longer = 0.03;  // of merit
constexpr double farthest_deg = 360.0;
constexpr double grid_deg = 45.0;
constexpr double least_dwell_s = 40.0, dwell_step_s = 30.0;

Schedule drawn(ExperimentLimits limits, unsigned k) {
  limits.rotation_s *= turn_times[k % turn_times.size()];  // another turn rate splits what depends on it
  Schedule plan = walk_over_positions(limits, dwells_s[(k + k / dwells_s.size()) % dwells_s.size()], 20261122U + k);
  if (k / dwells_s.size() % 2 == 1) {  // and dwells that differ what depends on time since a turn
    for (std::size_t d = 0; d < plan.dwell_s.size(); ++d) {
      plan.dwell_s[d] = dwells_s[d % dwells_s.size()];
    }
  }
  while (plan.duration_s() > limits.duration_s && plan.positions.size() > fewest_positions) {
    plan.positions.pop_back();
    plan.dwell_s.pop_back();
  }
  return plan;
}

class Changes {
 public:
  explicit Changes(const ExperimentLimits& limits) : limits_(limits) {}

  // One position elsewhere, some time of one dwell given to another, or another rate of the turns, the dwells giving the time; none
  // where that cannot be.
  std::optional<Schedule> change(Schedule plan) {
    const auto count = static_cast<int>(plan.positions.size());
    const int what = below(8);
    if (what == 0) {
      return at_another_rate(std::move(plan));
    }
    if (what < 6) {
      const std::size_t k = 1U + static_cast<std::size_t>(below(count - 1));
      GimbalPosition to = plan.positions[k];
      double& angle = below(2) == 0 ? to.outer_deg : to.inner_deg;
      const double sense = below(2) == 0 ? -1.0 : 1.0;
      angle += sense * grid_deg * (1 + below(2));
      const bool within = std::abs(to.outer_deg) <= farthest_deg && std::abs(to.inner_deg) <= farthest_deg;
      const bool from_before = can_move(plan.positions[k - 1], to);
      const bool to_next = k + 1 == plan.positions.size() || can_move(to, plan.positions[k + 1]);
      if (!within || !from_before || !to_next) {
        return std::nullopt;
      }
      plan.positions[k] = to;
    } else {
      const auto from = static_cast<std::size_t>(below(count)), to = static_cast<std::size_t>(below(count));
      if (from == to || plan.dwell_s[from] - dwell_step_s < least_dwell_s) {
        return std::nullopt;
      }
      plan.dwell_s[from] -= dwell_step_s;
      plan.dwell_s[to] += dwell_step_s;
    }
    return plan;
  }

 private:
  std::optional<Schedule> at_another_rate(Schedule plan) {
    const double rotation_s = limits_.rotation_s * turn_times[static_cast<std::size_t>(below(turn_times.size()))];
    const double less_s = (rotation_s - plan.rotation_s) * static_cast<double>(plan.dwell_s.size() - 1) /
                          static_cast<double>(plan.dwell_s.size());
    const double shortest = *std::min_element(plan.dwell_s.begin(), plan.dwell_s.end());
    if (rotation_s == plan.rotation_s || shortest - less_s < least_dwell_s) {
      return std::nullopt;
    }
    plan.rotation_s = rotation_s;
    for (double& dwell : plan.dwell_s) {
      dwell = std::floor(dwell - less_s);
    }
    return plan;
  }

  int below(std::size_t n) { return below(static_cast<int>(n)); }
  int below(int n) { return static_cast<int>(engine_() % static_cast<unsigned>(n)); }

  bool can_move(const GimbalPosition& a, const GimbalPosition& b) const {
    const double outer = std::abs(a.outer_deg - b.outer_deg), inner = std::abs(a.inner_deg - b.inner_deg);
    return outer + inner > 0.0 && std::max(outer, inner) <= limits_.largest_move_deg;
  }

  const ExperimentLimits& limits_;
  std::mt19937 engine_{20261123U};  // the standard fixes its bits
};

}  // namespace

RatedPlan search_plan(const ExperimentLimits& limits, double merit_now,
                      const std::function<double(const Schedule&)>& merit, const std::stop_token& stop) {
  const double wanted = merit_now + enough * (1.0 - merit_now);
  RatedPlan best{{}, merit_now};
  for (const double length : lengths) {
    ExperimentLimits shorter = limits;
    shorter.duration_s *= length;
    Changes changed(limits);
    RatedPlan here{{}, merit_now};
    for (unsigned k = 0; k < drawn_plans + changes && here.merit < wanted && !stop.stop_requested(); ++k) {
      if (k >= drawn_plans && here.plan.positions.empty()) {
        break;
      }
      std::optional<Schedule> next = k < drawn_plans ? drawn(shorter, k) : changed.change(here.plan);
      const double merit_then = next ? merit(*next) : 0.0;
      if (merit_then > here.merit) {
        here = {std::move(*next), merit_then};
      }
    }
    if (here.merit > best.merit + worth_longer) {
      best = std::move(here);
    }
    if (best.merit >= wanted || stop.stop_requested()) {
      break;
    }
  }
  return best;
}

}  // namespace selfcal::discovery
