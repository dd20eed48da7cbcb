// Which of the laws that the search found are to be taken out of a recording so that names of the catalogue may stand: guesses of which laws
// are none of the catalogue's.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/catalogue_reach.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_fit.hpp"

namespace selfcal::discovery {

struct FittedLaws {
  std::vector<LawTerm> terms;
  Eigen::VectorXd coefficient;  // in unit_of(axis)

  static FittedLaws fitted(const LawFit& fit) { return {fit.terms, fit.coefficient}; }
  // Without numbers.
  std::string forms() const;
  // Of the same forms, and of much the same sizes.
  bool much_like(const FittedLaws& other) const;
  // Those for which `kept` says so.
  FittedLaws where(const std::function<bool(std::size_t)>& kept) const;
};

// Of the square of laws, that the best effect alone must make of it. A name may be several effects, and laws a poor likeness of it.
constexpr double least_share_of_laws = 0.3;

// Laws to take out, and the names beside which they were found where they are no choice among those that stand alone: what else the
// catalogue would say of what is left is no matter.
struct LawGuess {
  FittedLaws laws;
  std::vector<const diagnosis::Effect*> beside;
};

// The strongest of these effects; null: there is none.
const diagnosis::ModelEffect* strongest(const std::vector<diagnosis::ModelEffect>& effects);

// Cheapest first; empty ones are to be passed over, and so are those in whose place no effect makes a part worth the name.
class LawGuesses {
 public:
  struct Of {
    std::size_t strongest_law = 0;
    bool processes = false;  // beside the laws: they may stand for any part of a name
    bool names = false;      // some are named already, beside these laws
  };
  // What the search finds beside a name.
  using LawsBeside = std::function<std::optional<FittedLaws>(const diagnosis::ModelEffect&)>;

  // `alone`: the laws of `recording` with nothing more taken out than is named; `rejected`: equations that the catalogue rejected. All but
  // `of` must outlive it.
  LawGuesses(const UnitRecording& recording, const std::vector<diagnosis::ModelEffect>& rejected,
             const FittedLaws& alone, const Of& of, LawsBeside laws_beside, const std::stop_token& stop);
  LawGuesses(const LawGuesses&) = delete;
  LawGuesses& operator=(const LawGuesses&) = delete;

  using Guess = std::function<std::optional<LawGuess>()>;
  // Some of the laws that stand alone.
  const std::vector<Guess>& choices() const { return choices_; }
  // What is found beside an effect that explains the recording best with one of the laws: of it the laws, or a process, may have made no
  // likeness that the choices would see.
  const std::vector<Guess>& beside_best_effects() const { return beside_best_effects_; }

 private:
  using Chosen = std::function<bool(std::size_t)>;

  void add(std::function<std::optional<FittedLaws>()> choice);
  void add_for_many(std::size_t strongest_law);
  std::optional<LawGuess> beside_best(std::size_t place);
  const CatalogueReach& reach();
  std::optional<FittedLaws> without_these(const std::vector<bool>& made) const;
  std::optional<FittedLaws> not_made_by_rejected() const;
  std::optional<FittedLaws> not_made_by_any();
  std::optional<FittedLaws> not_made_best();
  double share_of(const Chosen& of);
  std::optional<FittedLaws> beside(const diagnosis::ModelEffect& name);
  std::optional<FittedLaws> where(const Chosen& kept);

  const UnitRecording& recording_;
  const std::vector<diagnosis::ModelEffect>& rejected_;
  const FittedLaws& alone_;
  bool processes_;
  LawsBeside laws_beside_;
  const std::stop_token& stop_;
  std::vector<Guess> choices_, beside_best_effects_;
  std::optional<CatalogueReach> reach_;
};

}  // namespace selfcal::discovery
