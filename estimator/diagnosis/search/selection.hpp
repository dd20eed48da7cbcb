// The decisions of the search, each from the normal equations alone: what to add to the terms, to drop, to exchange, and what
// explains a recording as well. No pass is made here.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "estimator/diagnosis/regression/bias_process.hpp"

namespace selfcal::diagnosis {

// What one test's p-value is corrected for, and the limit that it is held to.
struct Significance {
  double log_threshold = 0.0;      // of corrected p-values
  double independent_tests = 1.0;  // of the catalogue on this recording (multiplicity.hpp), and of the walks
  double rows = 0.0;               // so many frequencies were searched for the line of a spectrum

  double corrected(double log_p, const Effect& effect) const;
  double corrected(double log_p) const;  // of a walk
  bool holds(double corrected_log_p) const { return corrected_log_p <= log_threshold; }
};

// One of both.
struct Addition {
  std::optional<Candidate> term;
  std::optional<BiasProcess> process;
};

// What explains most beside what is fitted: among `alternatives`, best by the p of its whole group, and `walks`, tested on the
// same evidence. None where nothing at all is significant. A walk can follow any slow curve: it is taken where it beats every
// equation by far, and by further where it does not go on inside the dwells (`goes_on`, asked when it matters).
// What is `immaterial` though significant is passed over. An effect that contains another, and explains no more than odds of 1:100 against it
// tell, gives way to it.
std::optional<Addition> best_addition(const Evidence& evidence, const std::vector<int>& fitted,
                                      const std::vector<Candidate>& alternatives,
                                      const std::vector<BiasProcess>& processes, const Significance& significance,
                                      const std::function<bool(const BiasProcess&)>& goes_on,
                                      const std::function<bool(const Candidate&, const GroupTest&)>& immaterial = {});

// The first term that is no longer significant given the others.
std::optional<std::size_t> weak_term(const Evidence& evidence, const std::vector<Candidate>& terms,
                                     const Significance& significance);

// The first term in whose place an alternative is better, and the best of those: an early choice may have been the least bad. Better is also
// what the term contains and does not beat (best_addition).
struct Exchange {
  std::size_t term = 0;
  Candidate by;
};
std::optional<Exchange> better_exchange(const Evidence& evidence, const std::vector<Candidate>& terms,
                                        const std::vector<Candidate>& alternatives);

// Effects among the alternatives that explain as well as term i does, beside the others: as good a likelihood, or one that only
// its further coefficients cost (an effect that contains the term).
std::vector<const Effect*> equivalents(const Evidence& evidence, const std::vector<Candidate>& terms, std::size_t i,
                                       const std::vector<Candidate>& alternatives);

}  // namespace selfcal::diagnosis
