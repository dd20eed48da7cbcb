#include "estimator/discovery/next_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/planned_rotation.hpp"

namespace selfcal::discovery {
namespace {

constexpr int random_plans = 10;
constexpr std::size_t most_rivals = 12;  // the most probable of a class
// A plan that tells less than this share of the class's probability apart settles nothing.
constexpr double least_help = 0.05;

std::vector<Schedule> plans(const ExperimentLimits& limits) {
  static constexpr std::array<double, 3> dwells_s = {60.0, 100.0, 150.0};
  std::vector<Schedule> all;
  for (unsigned k = 0; k < random_plans; ++k) {
    Schedule plan = walk_over_positions(limits, dwells_s[k % dwells_s.size()], 20261122U + k);
    plan.rotation_s *= k % 2 == 0 ? 1.0 : 2.0;  // another turn rate splits what depends on it
    if (k % dwells_s.size() == 1) {             // and dwells that differ what depends on time since a turn
      for (std::size_t d = 0; d < plan.dwell_s.size(); ++d) {
        plan.dwell_s[d] = dwells_s[d % dwells_s.size()];
      }
    }
    all.push_back(std::move(plan));
  }
  return all;
}

// The law and its rivals, with the size that each would have and its odds.
struct Members {
  std::vector<LawTerm> terms;
  Eigen::VectorXd odds, size_squared;
};

// Square of what b, fitted in its place, leaves of a.
double left_by(const Eigen::MatrixXd& G, const Members& m, Eigen::Index a, Eigen::Index b) {
  const double left = G(b, b) > 0.0 ? G(a, a) - G(a, b) * G(a, b) / G(b, b) : G(a, a);
  return m.size_squared(a) * std::max(0.0, left);
}

// Of the probability that two members drawn by their odds are two, the share in which they are told apart: linear in the
// logarithm of the odds until 1:100. Members that no plan tells apart cost every plan alike.
double told_apart(const Eigen::MatrixXd& G, const Members& m) {
  const double enough = 2.0 * std::log(100.0);
  double told = 0.0, all = 0.0;
  for (Eigen::Index a = 0; a < m.odds.size(); ++a) {
    for (Eigen::Index b = 0; b < m.odds.size(); ++b) {
      if (a != b) {
        all += m.odds(a) * m.odds(b);
        told += m.odds(a) * m.odds(b) * std::min(1.0, left_by(G, m, a, b) / enough);
      }
    }
  }
  return all > 0.0 ? told / all : 1.0;
}

// The rival that stands behind most of what a plan tells.
Eigen::Index most_told(const Eigen::MatrixXd& now, const Eigen::MatrixXd& with, const Members& m) {
  const double enough = 2.0 * std::log(100.0);
  Eigen::Index best = 1;
  double most = -1.0;
  for (Eigen::Index b = 1; b < m.odds.size(); ++b) {
    const double told =
        m.odds(b) * (std::min(1.0, left_by(with, m, 0, b) / enough) - std::min(1.0, left_by(now, m, 0, b) / enough));
    if (told > most) {
      most = told;
      best = b;
    }
  }
  return best;
}

Members members_of(const DiscoveredLaw& law) {
  std::vector<ClassMember> rivals = law.ambiguous;
  std::erase_if(rivals,
                [&](const ClassMember& m) { return m.expression == law.expression && m.axis == law.term.axis; });
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const ClassMember& a, const ClassMember& b) { return a.odds > b.odds; });
  Members members{{law.term}, {}, {}};
  std::vector<double> odds = {1.0};
  for (const ClassMember& m : rivals) {
    auto expression = laws::Expression::parse(m.expression);
    if (expression && !needs_temperature(*expression) && members.terms.size() <= most_rivals) {
      members.terms.push_back({m.axis, std::move(*expression), {}});
      odds.push_back(m.odds);
    }
  }
  members.odds = Eigen::Map<const Eigen::VectorXd>(odds.data(), static_cast<Eigen::Index>(odds.size()));
  return members;
}

}  // namespace

std::optional<NextExperiment> plan_experiment(std::span<const UnitRecording> recordings, const DiscoveredLaw& law,
                                              const ExperimentLimits& limits, const std::stop_token& stop) {
  Members members = members_of(law);
  const Eigen::Index count = members.odds.size();
  if (count < 2) {
    return std::nullopt;
  }
  Eigen::MatrixXd now = Eigen::MatrixXd::Zero(count, count);
  for (const UnitRecording& r : recordings) {
    now += information_of(r.data, diagnosis::forward_pass(r.data, r.calibration), members.terms, stop);
  }
  // What explains the recordings as well has the size that makes it as large on them.
  members.size_squared = (law.coefficient * law.coefficient * now(0, 0)) *
                         now.diagonal().cwiseMax(1e-12 * now.diagonal().maxCoeff()).cwiseInverse();
  const UnitRecording& last = recordings.back();
  const double told_now = told_apart(now, members);
  double best_told = told_now + least_help;
  std::optional<NextExperiment> best;
  for (const Schedule& plan : plans(limits)) {
    if (stop.stop_requested()) {
      break;
    }
    const Eigen::MatrixXd with =
        now + planned_information(plan, last, last.calibration.initial_attitude, members.terms, stop);
    const double told = told_apart(with, members);
    if (told > best_told) {
      best_told = told;
      const Eigen::Index rival = most_told(now, with, members);
      const LawTerm& term = members.terms[static_cast<std::size_t>(rival)];
      const double square = left_by(with, members, 0, rival);
      best = {plan, std::sqrt(left_by(now, members, 0, rival)), std::sqrt(square), 0.5 * square,
              term.expression.text(term.constants)};
    }
  }
  return best;
}

}  // namespace selfcal::discovery
