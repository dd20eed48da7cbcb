// From the ranking over the pieces to laws: constants refined, doubles left out.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "estimator/discovery/law_fit.hpp"
#include "estimator/discovery/piece_model.hpp"

namespace selfcal::discovery {

struct Constant;

struct Candidate {
  LawTerm term;
  double gain = 0.0, cost = 0.0;  // as in Ranked and Function, the cost of a free phase included
  bool step = false;              // its constant is an instant
  double coefficient = 0.0;       // where it was fitted exactly
  double spacing =
      0.0;  // of the values of its constant that share the cost, in logarithms; 0: it has none, or is a wave
  double merit() const { return 0.5 * gain - cost; }
  std::string text() const { return term.expression.text(term.constants); }
};

// Each candidate beside `given`, exactly, with its constant as it is and at six others around it.
std::vector<std::vector<Candidate>> exact_alternatives(std::span<const LawRecording> recordings,
                                                       const std::vector<LawTerm>& given,
                                                       const std::vector<Candidate>& candidates,
                                                       const std::stop_token& stop);
// The best alternative of each, best first.
std::vector<Candidate> best_of(const std::vector<std::vector<Candidate>>& alternatives);

class Shortlist {
 public:
  // All must outlive this.
  Shortlist(const PieceSums& sums, const Dictionary& dictionary);

  // The best `most` laws over the pieces given what the model has chosen, each expression once, constants of greatest
  // gain; best first. A third as many are added that are best beside the known columns (pieces.hpp). A law's means over the
  // pieces gain no more than the law does, with the known columns and without: the larger gain counts.
  std::vector<Candidate> best(const PieceModel& model, std::size_t most) const;
  // Both functions, each with its constant of greatest gain beside the other. The model has nothing chosen, before and after.
  std::array<Candidate, 2> refined(PieceModel& model, const Ranked& first, const Ranked& second) const;
  // A wave with other periods up to one of resolution away, amplitude and phase of greatest gain at each: where little of it is seen, several
  // fit alike, far beyond the sigma of a linearised fit. `wave_step` of the dictionary's periods apart. Of another law none.
  static constexpr double wave_step = 0.1;
  std::vector<Candidate> values_of_wave(const PieceModel& model, const Candidate& own) const;
  // Columns of a term over the pieces: itself and its derivatives by its constants.
  void add_columns(const PieceModel& model, const LawTerm& term, std::vector<Eigen::VectorXd>& columns) const;
  // Names, units and values of a term's constants, by where they stand in its expression.
  std::vector<Constant> constants(const LawTerm& term) const;

 private:
  std::vector<Candidate> best_over_pieces(const PieceModel& model, std::size_t most) const;
  Candidate candidate(const PieceModel& model, const Ranked& ranked) const;
  double longest_of(Kernel kernel) const;
  // Means over the pieces of a wave's sine and cosine of this period; `sine` is the text with the bare sine.
  Eigen::MatrixXd waves(const std::string& sine, const std::string& cosine, double period) const;
  std::pair<double, double> periods_about(const Function& wave) const;
  void limit(LawTerm& term, Kernel kernel) const;  // to twice the range in which its kernel is looked for
  double spacing_of(Kernel kernel) const;          // of its constants in the dictionary, in logarithms
  double gain_of(const PieceModel& model, const LawTerm& term) const;

  const PieceSums& sums_;
  const Dictionary& dictionary_;
  Eigen::MatrixXd known_;
  mutable std::optional<PieceProjection> beside_known_;  // of the information that was asked last
};

}  // namespace selfcal::discovery
