// What turns the search's results into words and verdicts: one judge, of one recording and of the difference of two.
#pragma once

#include <functional>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/search/search.hpp"

namespace selfcal::diagnosis {

// Sizes and their sigma in typical ones; the constant NaN: none.
std::vector<FindingParameter> finding_parameters(const Effect& effect, const Eigen::VectorXd& size,
                                                 const Eigen::VectorXd& sigma, double constant, double constant_sigma);

Finding describe(const Suspect& suspect);
Finding describe(const NamedTerm& term, double rows);
Finding describe(const BiasProcess& process, double rows);

// Of the false-alarm rate of a whole answer, what each kind of test may use up; together all of it.
struct FalseAlarmBudget {
  double names = 0.0;       // the catalogue and the bias processes
  double map = 0.0;         // single biases by dwell, rotation, after turns, time
  double structure = 0.0;   // biases of an axis together
  double whiteness = 0.0;   // of the innovations
  double size = 0.0;        // of the innovations
  double noise = 0.0;       // densities, quanta, lines
  double parameters = 0.0;  // the 24 of two recordings against each other

  constexpr bool adds_up() const {
    const double rest = names + map + structure + whiteness + size + noise + parameters - 1.0;
    return rest < 1e-12 && rest > -1e-12;
  }
};
constexpr FalseAlarmBudget budget_of_one{
    .names = 0.45, .map = 0.1, .structure = 0.1, .whiteness = 0.1, .size = 0.1, .noise = 0.15};
constexpr FalseAlarmBudget budget_of_two{
    .names = 0.5, .map = 0.1, .structure = 0.1, .whiteness = 0.1, .size = 0.1, .parameters = 0.1};
static_assert(budget_of_one.adds_up() && budget_of_two.adds_up());

// What differs between the cases that are judged.
struct Rules {
  FalseAlarmBudget budget;
  double alpha = 0.005;        // false-alarm rate of the whole answer
  bool motion_fitted = false;  // of a moored base
  bool coloured = false;       // by beats of a quantum, which are named as such and are no question of whiteness
  // Share of the misfit up to which what remains lets the names stand, though something else is there that has no name.
  double tolerable_share = 0.0;
  // Whether a process goes on inside the dwells. What jumps between them is nothing that the catalogue holds.
  std::function<bool(const BiasProcess&)> goes_on;
};

struct Judgement {
  Adequacy before, after;      // after.accepted: the names explain what is seen, and nothing remains
  std::vector<Finding> named;  // best first
  std::vector<Finding> jumps;  // processes that are none
  bool names_stand = false;
};

Judgement judge(const SearchResult& found, const Rules& rules);

// What the search and the judge say, in the document: findings or rejected names, places, the model, the 24.
void write_down(const SearchResult& found, const Judgement& judgement, Diagnosis& d);

DiagnosisVerdict verdict_of(bool named, bool unexplained, bool suspected);

// `alpha`: false-alarm rate of the whole recording; `alpha_elsewhere`: of places that the names have no part in, if less.
Adequacy adequacy(const Rules& rules, const Shown& shown, double rows, double alpha, double alpha_elsewhere);

}  // namespace selfcal::diagnosis
