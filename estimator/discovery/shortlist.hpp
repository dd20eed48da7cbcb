// From the ranking over the pieces to laws: constants refined, doubles left out.
#pragma once

#include <string>
#include <vector>

#include "estimator/discovery/law_fit.hpp"
#include "estimator/discovery/piece_model.hpp"

namespace selfcal::discovery {

struct Constant;

struct Candidate {
  LawTerm term;
  double gain = 0.0, cost = 0.0;  // as in Ranked and Function; two constants and a free phase cost one more
  bool step = false;              // its constant is an instant
  double merit() const { return 0.5 * gain - cost; }
  std::string text() const { return term.expression.text(term.constants); }
};

class Shortlist {
 public:
  // All must outlive this.
  Shortlist(const PieceSums& sums, const Dictionary& dictionary);

  // The best `most` laws over the pieces given what the model has chosen, each expression once, constants of greatest
  // gain; best first.
  std::vector<Candidate> best(const PieceModel& model, std::size_t most) const;
  // Columns of a term over the pieces: itself and its derivatives by its constants.
  void add_columns(const PieceModel& model, const LawTerm& term, std::vector<Eigen::VectorXd>& columns) const;
  // Names, units and values of a term's constants, by where they stand in its expression.
  std::vector<Constant> constants(const LawTerm& term) const;

 private:
  Candidate candidate(const PieceModel& model, const Ranked& ranked) const;
  double gain_of(const PieceModel& model, const LawTerm& term) const;

  const PieceSums& sums_;
  const Dictionary& dictionary_;
};

}  // namespace selfcal::discovery
