#include "estimator/discovery/next_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "estimator/diagnosis/still_calibration.hpp"
#include "estimator/discovery/plan_search.hpp"

namespace selfcal::discovery {
namespace {

constexpr std::size_t most_rivals = 12;  // the most probable of a class
// A plan that is worth less settles nothing.
constexpr double least_help = 0.05;
// Odds against the law from which an equation is no member of its class (DiscoveryOptions::least_odds).
constexpr double least_odds = 0.01;

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

// The probability that what is not true is excluded. `log_odds`: of the truth against it, as the recordings have them; they grow by half of
// `more`, what it leaves more of the truth, with a variance of all of that.
double excludes(double more, double log_odds) {
  const double wanted = -log_odds - std::log(least_odds);
  return more > 0.0 ? 0.5 * std::erfc((wanted - 0.5 * more) / std::sqrt(2.0 * more)) : wanted < 0.0 ? 1.0 : 0.0;
}

// The same of member b when a is the truth.
double excluded(const Eigen::MatrixXd& now, const Eigen::MatrixXd& with, const Members& m, Eigen::Index a,
                Eigen::Index b) {
  return excludes(left_by(with, m, a, b) - left_by(now, m, a, b), std::log(m.odds(a) / m.odds(b)));
}

// What a plan is worth, each member the truth with its probability: the share of the others that it excludes, and the probability that
// it excludes them all, half and half. The second alone does not say which way is up where one rival cannot be told.
double told_apart(const Eigen::MatrixXd& now, const Eigen::MatrixXd& with, const Members& m) {
  double told = 0.0;
  for (Eigen::Index a = 0; a < m.odds.size(); ++a) {
    double share = 0.0, all = 1.0;
    for (Eigen::Index b = 0; b < m.odds.size(); ++b) {
      if (a != b) {
        const double p = excluded(now, with, m, a, b);
        share += p / static_cast<double>(m.odds.size() - 1);
        all *= p;
      }
    }
    told += m.odds(a) / m.odds.sum() * 0.5 * (share + all);
  }
  return told;
}

// The rival that stands behind most of what a plan tells.
Eigen::Index most_told(const Eigen::MatrixXd& now, const Eigen::MatrixXd& with, const Members& m) {
  Eigen::Index best = 1;
  double most = -1.0;
  for (Eigen::Index b = 1; b < m.odds.size(); ++b) {
    const double told = m.odds(b) * excluded(now, with, m, 0, b);
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

namespace {

// Laws against the effects in whose place they stand, each as it was fitted.
struct AgainstNames {
  PlannedColumns columns;         // of the laws, these effects, and those that stay
  Eigen::VectorXd laws, effects;  // sizes, as the columns have them
  double log_odds = 0.0;          // of the laws

  // Square of what the other one leaves, fitted in its place beside the effects that stay.
  double left_of_laws(const Eigen::MatrixXd& G) const {
    return left(G, laws, 0, range(laws.size(), G.rows() - laws.size()));
  }
  double left_of_effects(const Eigen::MatrixXd& G) const {
    std::vector<Eigen::Index> others = range(0, laws.size());
    const Eigen::Index behind = laws.size() + effects.size();
    const std::vector<Eigen::Index> stay = range(behind, G.rows() - behind);
    others.insert(others.end(), stay.begin(), stay.end());
    return left(G, effects, laws.size(), others);
  }
  // The probability that what is not true is excluded, by a rotation of so much more information.
  double told(const Eigen::MatrixXd& now, const Eigen::MatrixXd& with) const {
    const double true_laws = 1.0 / (1.0 + std::exp(-log_odds));
    return true_laws * excludes(left_of_laws(with) - left_of_laws(now), log_odds) +
           (1.0 - true_laws) * excludes(left_of_effects(with) - left_of_effects(now), -log_odds);
  }

 private:
  static std::vector<Eigen::Index> range(Eigen::Index first, Eigen::Index count) {
    std::vector<Eigen::Index> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), first);
    return all;
  }
  static double left(const Eigen::MatrixXd& G, const Eigen::VectorXd& size, Eigen::Index at,
                     const std::vector<Eigen::Index>& others) {
    const Eigen::Index n = size.size();
    Eigen::MatrixXd inner = G(others, others);
    inner.diagonal() *= 1.0 + 1e-9;  // a column that the rotation does not show takes up nothing
    inner.diagonal().array() += 1e-12;
    const Eigen::VectorXd shown = G.middleCols(at, n)(others, Eigen::all) * size;
    return std::max(0.0, size.dot(G.block(at, at, n, n) * size) - shown.dot(inner.ldlt().solve(shown)));
  }
};

// None where an effect or a law follows the temperature, or a law is a process: nobody knows that of a rotation that was not made.
std::optional<AgainstNames> against_names(const diagnosis::Diagnosis& d) {
  AgainstNames a;
  std::vector<double> laws, effects;
  for (const diagnosis::LawsInstead::Law& law : d.instead->laws) {
    auto expression = laws::Expression::parse(law.expression);  // of a process: nothing
    if (!expression || needs_temperature(*expression)) {
      return std::nullopt;
    }
    a.columns.laws.push_back({law.place, std::move(*expression), {}});
    laws.push_back(law.coefficient);
  }
  std::vector<EffectTerm> stay;
  for (const diagnosis::ModelEffect& m : d.model) {
    if (m.effect->temperature == diagnosis::TemperatureUse::measured) {
      return std::nullopt;
    }
    if (m.effect->sensor == nullptr) {
      continue;
    }
    const EffectTerm term{m.effect, m.constant, m.size, false};
    const std::vector<const diagnosis::Effect*>& replaced = d.instead->names;
    if (std::find(replaced.begin(), replaced.end(), m.effect) == replaced.end()) {
      stay.push_back(term);
    } else {
      a.columns.effects.push_back(term);
      effects.insert(effects.end(), m.size.begin(), m.size.end());
    }
  }
  a.columns.effects.insert(a.columns.effects.end(), stay.begin(), stay.end());
  a.laws = Eigen::Map<const Eigen::VectorXd>(laws.data(), static_cast<Eigen::Index>(laws.size()));
  a.effects = Eigen::Map<const Eigen::VectorXd>(effects.data(), static_cast<Eigen::Index>(effects.size()));
  a.log_odds = std::log(d.instead->odds);
  return a;
}

}  // namespace

std::optional<NextExperiment> plan_against_names(const UnitRecording& recording, const diagnosis::Diagnosis& d,
                                                 const ExperimentLimits& limits, const std::stop_token& stop) {
  if (!d.instead) {
    return std::nullopt;
  }
  const auto members = against_names(d);
  if (!members) {
    return std::nullopt;
  }
  const Eigen::MatrixXd now = information_of(
      recording.data, diagnosis::forward_pass(recording.data, recording.calibration), members->columns, stop);
  const Planning planning(recording);
  const auto with = [&](const Schedule& plan) -> Eigen::MatrixXd {
    return now + planning.information(plan, recording.calibration.initial_attitude, members->columns, stop);
  };
  const RatedPlan best = search_plan(
      limits, 0.0, [&](const Schedule& plan) { return members->told(now, with(plan)); }, stop);
  if (best.plan.positions.empty() || best.merit < least_help) {
    return std::nullopt;
  }
  const double before = members->left_of_laws(now), after = members->left_of_laws(with(best.plan));
  return NextExperiment{best.plan, std::sqrt(before), std::sqrt(after), 0.5 * after,
                        members->columns.effects.front().effect->id};
}

std::optional<NextExperiment> plan_experiment(std::span<const UnitRecording> recordings, const DiscoveredLaw& law,
                                              const ExperimentLimits& limits, const std::stop_token& stop) {
  Members members = members_of(law);
  const Eigen::Index count = members.odds.size();
  if (count < 2) {
    return std::nullopt;
  }
  Eigen::MatrixXd now = Eigen::MatrixXd::Zero(count, count);
  for (const UnitRecording& r : recordings) {
    now += information_of(r.data, diagnosis::forward_pass(r.data, r.calibration), {members.terms}, stop);
  }
  // What explains the recordings as well has the size that makes it as large on them.
  members.size_squared = (law.coefficient * law.coefficient * now(0, 0)) *
                         now.diagonal().cwiseMax(1e-12 * now.diagonal().maxCoeff()).cwiseInverse();
  const UnitRecording& last = recordings.back();
  const double told_now = told_apart(now, now, members);
  const Planning planning(last);
  const auto with = [&](const Schedule& plan) -> Eigen::MatrixXd {
    return now + planning.information(plan, last.calibration.initial_attitude, {members.terms}, stop);
  };
  RatedPlan best = search_plan(
      limits, told_now, [&](const Schedule& plan) { return told_apart(now, with(plan), members); }, stop);
  if (best.plan.positions.empty() || best.merit < told_now + least_help) {
    // What one rotation does not tell two may.
    best = search_plan(
        limits, told_now, [&](const Schedule& plan) { return told_apart(now, 2.0 * with(plan) - now, members); }, stop);
  }
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
