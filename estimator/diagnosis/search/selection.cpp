#include "estimator/diagnosis/search/selection.hpp"

#include <algorithm>
#include <cmath>

namespace selfcal::diagnosis {
namespace {

// An equation comes before a walk that explains more where its log p is at least this share of the walk's: a walk follows any
// slow curve, and so explains what an equation does and some of the noise with it. An equation whose constant still stands on
// its grid explains a little less than it will: with neighbours a factor of 2 apart an exponential keeps 97 % of its square.
// The rest of the 15 % is a choice that decides nothing: of 18 walks met in 209 blind cases the best equation has a share of
// at most 0.749 or of at least 0.947 (tests/RESULTS.md, 2026-11-22).
constexpr double equation_share = 0.85;
// What jumps between dwells is no walk: it is taken only where no equation comes near. A choice, and one that decides: shares lie
// everywhere between 0.05 and 1, none of 34 from 0.563 to 0.613. What is taken as a jump is refused by the judge; what is
// taken as an equation has still to explain.
constexpr double jump_share = 0.6;
// Effects whose odds against the best are better than 1:100 stay in its class.
const double class_log_odds = std::log(100.0);
// An effect that contains the term gains as much, but for rounding, the grid and a few refits, and keeps this share of its log p in
// spite of its further coefficients. A choice: too small a share lists an effect more in the class, and names none. Of 20 that
// gain as much in 209 blind cases none has a share from 0.757 to 0.820; with 0.9 a flexure lost the cross-coupling that contained it while this had the squares too.
constexpr double contained_gain = 2.0, contained_share = 0.8;
// What is to take a term's place must be better by a factor of e: else two that are alike would change places for ever.
constexpr double least_improvement = 1.0;

// One effect contains another where it leaves less than this share of what that one shows: the squares of the other axes contain the own
// one's, for gravity's add up to a constant.
constexpr double left_of_contained = 0.01;

bool names(const std::vector<Candidate>& terms, const Effect* effect) {
  return std::any_of(terms.begin(), terms.end(), [&](const Candidate& t) { return t.effect == effect; });
}

bool contains(const Evidence& evidence, const Candidate& whole, const Candidate& part, const std::vector<int>& others) {
  std::vector<int> beside = columns_of(whole);
  beside.insert(beside.end(), others.begin(), others.end());
  const std::vector<int> own = columns_of(part);
  const Eigen::VectorXd left = evidence.given(own, beside).information.diagonal(),
                        all = evidence.given(own, others).information.diagonal();
  return all.maxCoeff() > least_information &&
         (left.array() <= left_of_contained * all.array() + least_information).all();
}

// Of two effects that explain a recording alike, one of which contains the other, the simpler one is named.
bool gives_way(const Evidence& evidence, const Candidate& whole, const GroupTest& of_whole, const Candidate& part,
               const GroupTest& of_part, const std::vector<int>& others) {
  return of_part.rank < of_whole.rank && of_part.log_p < of_whole.log_p + class_log_odds &&
         contains(evidence, whole, part, others);
}

}  // namespace

double Significance::corrected(double log_p, const Effect& effect) const {
  const bool spectrum = effect.constant.kind == EffectConstant::Kind::spectrum;
  return log_corrected(log_p, independent_tests * (spectrum ? searched_frequencies(rows) : 1.0));
}

double Significance::corrected(double log_p) const { return log_corrected(log_p, independent_tests); }

std::optional<Addition> best_addition(const Evidence& evidence, const std::vector<int>& fitted,
                                      const std::vector<Candidate>& alternatives,
                                      const std::vector<BiasProcess>& processes, const Significance& significance,
                                      const std::function<bool(const BiasProcess&)>& goes_on,
                                      const std::function<bool(const Candidate&, const GroupTest&)>& immaterial) {
  double best_equation = 0.0, best_walk = 0.0, detected = 0.0;  // name by the former, presence by the last
  const Candidate* equation = nullptr;
  GroupTest of_equation;
  std::vector<std::pair<const Candidate*, GroupTest>> seen;
  for (const Candidate& c : alternatives) {
    const GroupTest test = test_group(evidence, columns_of(c), fitted);
    const double log_p = significance.corrected(test.log_detection, *c.effect);
    if (immaterial && significance.holds(log_p) && immaterial(c, test)) {
      continue;
    }
    detected = std::min(detected, log_p);
    seen.emplace_back(&c, test);
    if (test.log_p < best_equation) {
      best_equation = test.log_p;
      equation = &c;
      of_equation = test;
    }
  }
  for (const auto& [part, test] : seen) {
    if (equation != nullptr && gives_way(evidence, *equation, of_equation, *part, test, fitted)) {
      equation = part;
      of_equation = test;
      best_equation = test.log_p;
    }
  }
  // A walk has one coefficient, at the edge of its range (half a chi-squared), an instability its correlation time besides.
  const BiasProcess* process = nullptr;
  for (const BiasProcess& test : processes) {
    const double log_p = test.log_p();
    detected = std::min(detected, significance.corrected(log_p));
    if (log_p < std::min(best_walk, best_equation)) {
      best_walk = log_p;
      process = &test;
    }
  }
  if (!significance.holds(detected) || (process == nullptr && equation == nullptr)) {
    return std::nullopt;
  }
  if (process != nullptr && equation != nullptr &&
      best_equation < (goes_on(*process) ? equation_share : jump_share) * best_walk) {
    process = nullptr;
  }
  if (process != nullptr) {
    return Addition{{}, *process};
  }
  return Addition{*equation, {}};
}

std::optional<std::size_t> weak_term(const Evidence& evidence, const std::vector<Candidate>& terms,
                                     const Significance& significance) {
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const GroupTest test = test_group(evidence, columns_of(terms[i]), columns_of(terms, i));
    if (!significance.holds(significance.corrected(test.log_detection, *terms[i].effect))) {
      return i;
    }
  }
  return std::nullopt;
}

std::optional<Exchange> better_exchange(const Evidence& evidence, const std::vector<Candidate>& terms,
                                        const std::vector<Candidate>& alternatives) {
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const std::vector<int> others = columns_of(terms, i);
    const GroupTest own = test_group(evidence, columns_of(terms[i]), others);
    double best = own.log_p - least_improvement;
    const Candidate* winner = nullptr;
    for (const Candidate& c : alternatives) {
      if (names(terms, c.effect)) {  // its constant is refined already
        continue;
      }
      const GroupTest test = test_group(evidence, columns_of(c), others);
      if (gives_way(evidence, terms[i], own, c, test, others)) {
        return Exchange{i, c};
      }
      if (test.log_p < best && !gives_way(evidence, c, test, terms[i], own, others)) {
        best = test.log_p;
        winner = &c;
      }
    }
    if (winner != nullptr) {
      return Exchange{i, *winner};
    }
  }
  return std::nullopt;
}

std::vector<const Effect*> equivalents(const Evidence& evidence, const std::vector<Candidate>& terms, std::size_t i,
                                       const std::vector<Candidate>& alternatives) {
  const std::vector<int> others = columns_of(terms, i);
  const GroupTest own = test_group(evidence, columns_of(terms[i]), others);
  std::vector<const Effect*> all;
  for (const Candidate& rival : alternatives) {
    if (names(terms, rival.effect) || std::find(all.begin(), all.end(), rival.effect) != all.end()) {
      continue;
    }
    const GroupTest test = test_group(evidence, columns_of(rival), others);
    const bool only_longer =
        test.delta_chi2 > own.delta_chi2 - contained_gain && test.log_p < contained_share * own.log_p;
    if (test.log_p < own.log_p + class_log_odds || only_longer) {
      all.push_back(rival.effect);
    }
  }
  return all;
}

}  // namespace selfcal::diagnosis
