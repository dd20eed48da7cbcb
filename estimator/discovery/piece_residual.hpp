// The normal equations over the pieces of all recordings, whose residual is that of the calibration or what laws leave of it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <stop_token>
#include <vector>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/discovery.hpp"
#include "estimator/discovery/law_fit.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/pieces.hpp"
#include "estimator/discovery/scene.hpp"

namespace selfcal::discovery {

// Stays where it is: models refer to the sums.
class PieceResidual {
 public:
  using Scenes = std::vector<std::unique_ptr<Scene>>;

  // Fills the scenes' tables. The scenes must outlive it.
  PieceResidual(const Scenes& scenes, std::stop_token stop, const Progress& progress);
  PieceResidual(const PieceResidual&) = delete;
  PieceResidual& operator=(const PieceResidual&) = delete;

  const PieceSums& sums() const { return sums_; }
  const Dictionary& dictionary() const { return dictionary_; }
  laws::VariableSet available() const;  // in all recordings
  PieceModel& model() { return *model_; }
  const PieceModel& model() const { return *model_; }
  // With the laws in, which model() is where none are out.
  PieceModel& whole_model() { return whole_model_ ? *whole_model_ : *model_; }

  // From here on sums() and model() are of what the laws of this fit leave, by a pass over every recording less its laws: of a law of 30
  // sigma the pieces' means leave what a process could take up. Nothing is chosen in model() then. Where these laws are out already the
  // pass is spared.
  void take_out(const LawFit& fit);
  void put_back();  // all of them; nothing is chosen in model() then
  void renew();     // model() as nothing was chosen in it, nor integrated out

 private:
  PieceSums sum_whole();
  PieceSums sum_without(const LawFit& fit) const;

  const Scenes& scenes_;
  std::stop_token stop_;
  PieceSums sums_;
  Dictionary dictionary_;
  std::shared_ptr<const PieceInformation> information_;
  std::unique_ptr<PieceModel> model_, whole_model_;
  Eigen::VectorXd whole_score_;
  double whole_square_ = 0.0;
  std::vector<LawTerm> out_;
  Eigen::VectorXd coefficient_;  // of those that are out
};

}  // namespace selfcal::discovery
