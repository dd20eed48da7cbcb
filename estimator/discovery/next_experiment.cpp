#include "estimator/discovery/next_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/plan_search.hpp"

namespace selfcal::discovery {
namespace {

constexpr std::size_t most_rivals = 12;  // the most probable of a class
// A plan that tells less than this share of the class's probability apart settles nothing.
constexpr double least_help = 0.05;
// Square of the separation from which the odds are beyond 1:100, which a class does not hold, in 19 of 20 recordings.
constexpr double told_for_sure = 25.0;

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
// expected logarithm of the odds until they are told for sure.
double told_apart(const Eigen::MatrixXd& G, const Members& m) {
  double told = 0.0, all = 0.0;
  for (Eigen::Index a = 0; a < m.odds.size(); ++a) {
    for (Eigen::Index b = 0; b < m.odds.size(); ++b) {
      if (a != b) {
        all += m.odds(a) * m.odds(b);
        told += m.odds(a) * m.odds(b) * std::min(1.0, left_by(G, m, a, b) / told_for_sure);
      }
    }
  }
  return all > 0.0 ? told / all : 1.0;
}

// The rival that stands behind most of what a plan tells.
Eigen::Index most_told(const Eigen::MatrixXd& now, const Eigen::MatrixXd& with, const Members& m) {
  Eigen::Index best = 1;
  double most = -1.0;
  for (Eigen::Index b = 1; b < m.odds.size(); ++b) {
    const double told = m.odds(b) * (std::min(1.0, left_by(with, m, 0, b) / told_for_sure) -
                                     std::min(1.0, left_by(now, m, 0, b) / told_for_sure));
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
  const auto with = [&](const Schedule& plan) -> Eigen::MatrixXd {
    return now + planned_information(plan, last, last.calibration.initial_attitude, members.terms, stop);
  };
  const RatedPlan best = search_plan(
      limits, told_now, [&](const Schedule& plan) { return told_apart(with(plan), members); }, stop);
  if (best.plan.positions.empty() || best.merit < told_now + least_help) {
    return std::nullopt;
  }
  const Eigen::MatrixXd after = with(best.plan);
  const Eigen::Index rival = most_told(now, after, members);
  const LawTerm& term = members.terms[static_cast<std::size_t>(rival)];
  const double square = left_by(after, members, 0, rival);
  return NextExperiment{best.plan, std::sqrt(left_by(now, members, 0, rival)), std::sqrt(square), 0.5 * square,
                        term.expression.text(term.constants)};
}

}  // namespace selfcal::discovery
