#include "estimator/discovery/next_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/planned_rotation.hpp"

namespace selfcal::discovery {
namespace {

constexpr int random_plans = 10;
constexpr std::size_t most_rivals = 12;  // the most probable of a class
// A plan that adds less than this to the separation of the closest rival settles nothing.
constexpr double least_help_sigma = 1.0;

std::vector<Schedule> plans(const ExperimentLimits& limits) {
  std::vector<Schedule> all;
  for (unsigned k = 0; k < random_plans; ++k) {
    static constexpr std::array<double, 3> dwells_s = {60.0, 100.0, 150.0};
    Schedule plan = walk_over_positions(limits, dwells_s[k % dwells_s.size()], 20261122U + k);
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

std::vector<LawTerm> members_of(const DiscoveredLaw& law) {
  std::vector<ClassMember> rivals = law.ambiguous;
  std::erase_if(rivals,
                [&](const ClassMember& m) { return m.expression == law.expression && m.axis == law.term.axis; });
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const ClassMember& a, const ClassMember& b) { return a.odds > b.odds; });
  std::vector<LawTerm> terms = {law.term};
  for (const ClassMember& m : rivals) {
    auto expression = laws::Expression::parse(m.expression);
    if (expression && !needs_temperature(*expression) &&
        terms.size() <= most_rivals) {  // nobody knows the temperature of a planned recording
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
    now += square * information_of(r.data, diagnosis::forward_pass(r.data, r.calibration), terms, stop);
  }
  const UnitRecording& last = recordings.back();
  NextExperiment best;
  best.separation_now = std::sqrt(closest_in(now).square);
  for (const Schedule& plan : plans(limits)) {
    if (stop.stop_requested()) {
      break;
    }
    const Closest closest =
        closest_in(now + square * planned_information(plan, last, last.calibration.initial_attitude, terms, stop));
    const double separation = std::sqrt(closest.square);
    if (separation > best.separation) {
      const LawTerm& rival = terms[static_cast<std::size_t>(closest.column)];
      best = {plan, best.separation_now, separation, 0.5 * closest.square, rival.expression.text(rival.constants)};
    }
  }
  return best.separation > best.separation_now + least_help_sigma ? std::optional(best) : std::nullopt;
}

}  // namespace selfcal::discovery
