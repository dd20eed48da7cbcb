// Names that leave nothing, each against any function in its place. The recordings less all names are passed over once, with the columns of
// the names beside those of the pieces; that some names are in again, and that the others are fitted anew, is then arithmetic.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/named_effects.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {

class HeldNames {
 public:
  // `less`: with the names taken out, one of a sensor at least; it must outlive this.
  HeldNames(const UnexplainedRest& less, std::stop_token stop, const Progress& progress = {});

  // Of sensors, in the order of `less.effects()`.
  const std::vector<const diagnosis::Effect*>& names() const { return names_; }
  double rows() const { return sums_.sums.rows; }
  double dwells() const { return sums_.dwells(); }

  // By how much more than the names for which `out` says so do, the best function makes the square fall in their place, all other names
  // fitted anew: found over the pieces, and where it may be `least` or more exactly, its constants free.
  // Functions of axes for which `allowed` does not say so do not count.
  double most_beyond(const std::vector<bool>& out, double least, const std::function<bool(int)>& allowed);
  // The same of each choice among these laws, those of a choice together.
  std::vector<double> beyond(const std::vector<bool>& out, const std::vector<LawTerm>& laws,
                             const std::vector<std::vector<std::size_t>>& choices) const;
  // The same of an offset that is drawn anew at each turn, on each axis that shows one and counts: twice the logarithm of what the likelihood
  // gains, sizes and axes paid for.
  double jumps_beyond(const std::vector<bool>& out, const std::function<bool(int)>& allowed);
  // Fall of the square by the names for which `out` says so, all other names fitted beside them.
  double by_names(const std::vector<bool>& out) const;

 private:
  struct Columns;
  Columns columns(const std::vector<bool>& out) const;
  void look_at(const Columns& columns);
  // Fall of the square by all names, those that are out with one coefficient in all recordings.
  double with_one_physics(const std::vector<bool>& out, const Eigen::VectorXd& score) const;

  std::stop_token stop_;
  std::vector<const diagnosis::Effect*> names_;
  std::vector<std::unique_ptr<Scene>> scenes_;
  std::vector<std::vector<EffectTerm>> terms_;  // [recordings] the names on it
  std::vector<std::size_t> name_of_;            // [columns] one recording behind the other
  std::vector<std::size_t> within_;             // [columns] which of the name's
  Eigen::VectorXd size_;                        // [columns] as named; 0 of the derivative by a constant
  BesidePieces beside_;                         // of all recordings
  PieceSums sums_;
  Dictionary dictionary_;
  std::unique_ptr<PieceModel> model_;
};

}  // namespace selfcal::discovery
