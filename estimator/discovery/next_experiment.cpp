#include "estimator/discovery/next_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/diagnosis/still_calibration.hpp"

namespace selfcal::discovery {
namespace {

constexpr double planning_rate_hz = 20.0;
constexpr double grid_deg = 45.0;
constexpr int random_plans = 10;
constexpr std::size_t most_rivals = 12;  // the most probable of a class
// A plan that adds less than this to the separation of the closest rival settles nothing.
constexpr double least_help_sigma = 1.0;

// A walk over positions of the grid that visits what it has not seen before if it can, within the limits.
Schedule random_plan(const ExperimentLimits& limits, double dwell_s, unsigned seed) {
  std::mt19937 engine(seed);  // the standard fixes its bits; no distribution of the standard is used
  const auto below = [&engine](int n) { return static_cast<int>(engine() % static_cast<unsigned>(n)); };
  const int reach = static_cast<int>(limits.largest_move_deg / grid_deg);
  Schedule plan;
  plan.rotation_s = limits.rotation_s;
  GimbalPosition at;
  const auto count = static_cast<std::size_t>(std::max(3.0, limits.duration_s / (dwell_s + limits.rotation_s)));
  while (plan.positions.size() < count) {
    plan.positions.push_back(at);
    plan.dwell_s.push_back(dwell_s);
    GimbalPosition next = at;
    for (int tries = 0; tries < 20; ++tries) {
      next = {at.outer_deg + grid_deg * (below(2 * reach + 1) - reach),
              at.inner_deg + grid_deg * (below(2 * reach + 1) - reach)};
      const bool moves = next.outer_deg != at.outer_deg || next.inner_deg != at.inner_deg;
      const bool within = std::abs(next.outer_deg) <= 360.0 && std::abs(next.inner_deg) <= 360.0;
      const bool seen = std::any_of(plan.positions.begin(), plan.positions.end(), [&](const GimbalPosition& p) {
        return p.outer_deg == next.outer_deg && p.inner_deg == next.inner_deg;
      });
      if (moves && within && !seen) {
        break;
      }
      next = moves && within ? next : at;
    }
    at = next;
  }
  return plan;
}

std::vector<Schedule> plans(const ExperimentLimits& limits) {
  std::vector<Schedule> all;
  for (unsigned k = 0; k < random_plans; ++k) {
    static constexpr std::array<double, 3> dwells_s = {60.0, 100.0, 150.0};
    Schedule plan = random_plan(limits, dwells_s[k % dwells_s.size()], 20261122U + k);
    plan.rotation_s *= k % 2 == 0 ? 1.0 : 2.0;  // another turn rate splits what depends on it
    all.push_back(std::move(plan));
  }
  return all;
}

// Square of what rival b leaves of law a (the first column).
double left_by(const Eigen::MatrixXd& G, Eigen::Index b) {
  return G(b, b) > 0.0 ? std::max(0.0, G(0, 0) - G(0, b) * G(0, b) / G(b, b)) : G(0, 0);
}

struct Closest {
  double square = 0.0;
  Eigen::Index column = 0;
};
Closest closest_in(const Eigen::MatrixXd& G) {
  Closest best{left_by(G, 1), 1};
  for (Eigen::Index b = 2; b < G.cols(); ++b) {
    const double left = left_by(G, b);
    best = left < best.square ? Closest{left, b} : best;
  }
  return best;
}

Eigen::MatrixXd information(const ImuData& data, const PassInput& input, const std::vector<LawTerm>& terms,
                            const std::stop_token& stop) {
  const diagnosis::RecordingContext context(data);
  const LawMotion motion(context);
  const NodeTable table = collect_nodes(motion, input);
  LawColumns columns(motion, table, terms, false);
  return run_columns(input, columns, stop).information;
}

std::vector<LawTerm> members_of(const DiscoveredLaw& law) {
  std::vector<ClassMember> rivals = law.ambiguous;
  std::erase_if(rivals,
                [&](const ClassMember& m) { return m.expression == law.expression && m.axis == law.term.axis; });
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const ClassMember& a, const ClassMember& b) { return a.odds > b.odds; });
  std::vector<LawTerm> terms = {law.term};
  for (const ClassMember& m : rivals) {
    auto expression = laws::Expression::parse(m.expression);
    const bool thermal = expression && (expression->variables().test(static_cast<std::size_t>(laws::Variable::T)) ||
                                        expression->variables().test(static_cast<std::size_t>(laws::Variable::dT)));
    if (expression && !thermal && terms.size() <= most_rivals) {  // nobody knows the temperature of a planned recording
      terms.push_back({m.axis, std::move(*expression), {}});
    }
  }
  return terms;
}

}  // namespace

std::optional<NextExperiment> plan_experiment(std::span<const UnitRecording> recordings, const DiscoveredLaw& law,
                                              const ExperimentLimits& limits, const std::stop_token& stop) {
  const std::vector<LawTerm> terms = members_of(law);
  if (terms.size() < 2) {
    return std::nullopt;
  }
  const double square = law.coefficient * law.coefficient;
  const auto count = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd now = Eigen::MatrixXd::Zero(count, count);
  for (const UnitRecording& r : recordings) {
    now += square * information(r.data, diagnosis::forward_pass(r.data, r.calibration), terms, stop);
  }
  const UnitRecording& last = recordings.back();
  NextExperiment best;
  best.separation_now = std::sqrt(closest_in(now).square);
  for (const Schedule& plan : plans(limits)) {
    if (stop.stop_requested()) {
      break;
    }
    const diagnosis::IdealRecording ideal(plan, last.calibration.initial_attitude, last.data.site, planning_rate_hz);
    PassInput input = diagnosis::forward_pass(ideal.data(), last.calibration);
    input.parameters.setZero();
    input.C_nb = ideal.C_nb_start();
    const Closest closest = closest_in(now + square * information(ideal.data(), input, terms, stop));
    const double separation = std::sqrt(closest.square);
    if (separation > best.separation) {
      const LawTerm& rival = terms[static_cast<std::size_t>(closest.column)];
      best = {plan, best.separation_now, separation, 0.5 * closest.square, rival.expression.text(rival.constants)};
    }
  }
  return best.separation > best.separation_now + least_help_sigma ? std::optional(best) : std::nullopt;
}

}  // namespace selfcal::discovery
