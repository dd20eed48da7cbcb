// What explains the recordings in the place of a law, and which of that is one function in other words.
#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

#include "estimator/discovery/carry_over.hpp"
#include "estimator/discovery/shortlist.hpp"

namespace selfcal::discovery {

// Of the belief in a function with a constant, which is that of the constants about one value of the dictionary's, what each of these
// stands for: as many of them as lie between it and the middles towards its neighbours. `alternatives`: of one function, constants
// ascending. One alone, or one without a constant: all of it.
std::vector<double> shares_of(const std::vector<Candidate>& alternatives);

class LawClass {
 public:
  // `others`: every function that was tried in the place of `own`, each with several values of its constant. `like`: the unit,
  // its noise and its site. Members have at least `least_odds` against `own`. `own_values`: `own` with other values of its
  // constants, as these leave them open.
  LawClass(const UnitRecording& like, Candidate own, const std::vector<std::vector<Candidate>>& others,
           const std::vector<Candidate>& own_values, double least_odds, const std::stop_token& stop);

  // Members with each value of a constant by itself, `own` first, and what holds of them elsewhere.
  const std::vector<Candidate>& possible() const { return possible_; }
  const CarryOver& elsewhere() const { return elsewhere_; }
  // The place in `possible` of what holds elsewhere with the greatest probability, of those with a twentieth of the odds of the most probable
  // one and more. Of values of one constant only the most probable one is asked: a fit would move the others to it.
  std::size_t best_elsewhere() const;

  // Each expression once, `own` first.
  std::vector<Candidate> members() const { return split(true); }
  std::vector<Candidate> tried_beside() const { return split(false); }
  // One entry for each function, simplest first.
  std::vector<ClassMember> functions() const;

 private:
  double odds(const Candidate& c) const;
  bool is_member(const Candidate& c) const;
  std::vector<Candidate> split(bool members) const;
  std::size_t place(const Candidate& c) const;
  enum class Likeness { none, here, anywhere };
  Likeness likeness(const Candidate& a, const Candidate& b) const;

  Candidate own_;
  std::vector<Candidate> tried_;  // the others, each with its best constant, most probable first
  double least_odds_;
  std::vector<Candidate> possible_;
  std::vector<PossibleLaw> laws_;  // the same, with odds against `own`
  CarryOver elsewhere_;            // of them
};

}  // namespace selfcal::discovery
