// What turns test results into words and verdicts: shared by the diagnosis of one recording and of two.
#pragma once

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/naming.hpp"

namespace selfcal::diagnosis {

Finding describe(const Suspect& suspect);
Finding describe(const Chosen& chosen, double rows);
Finding describe(const WalkTest& walk, double rows);

// Of the false-alarm rate of a whole answer, what each kind of test may use up; together all of it.
struct FalseAlarmBudget {
  double names = 0.0;       // the catalogue and the walks
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

// `alpha`: false-alarm rate of the whole recording; `alpha_elsewhere`: of places that the names have no part in, if less.
// `motion_fitted`: of a moored base.
Adequacy adequacy(const FalseAlarmBudget& budget, double square, double rows, double log_p_white, const Map& map,
                  double alpha, bool motion_fitted, double alpha_elsewhere = 1.0);

}  // namespace selfcal::diagnosis
