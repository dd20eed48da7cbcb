// Score and information of every function of the dictionary on every axis, given the terms chosen so far.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "estimator/discovery/dictionary.hpp"

namespace selfcal::discovery {

// A function on an axis and what it gains.
struct Ranked {
  int axis = 0;
  int function = 0;
  double gain = 0.0;   // fall of the residuals' square
  double merit = 0.0;  // gain / 2 less the cost: logarithm of the odds against nothing, but for a constant
};

// What a phase that is fitted costs in the logarithm of the odds: all of 2 pi before the data, 1/sqrt(gain) rad after them.
double cost_of_phase(double gain);

// The information of the normal equations over the pieces and that of every function of the dictionary in them. It takes a product
// of the size pieces^2 x functions, and belongs to all models of the recording whatever its residual is.
struct PieceInformation {
  PieceInformation(Eigen::MatrixXd information, const Dictionary& dictionary);
  // Columns X become random: W = G X L'^-1, L L' = X'G X + I/q, is taken off (Woodbury).
  std::shared_ptr<PieceInformation> less(const Eigen::MatrixXd& W, const Dictionary& dictionary) const;

  Eigen::MatrixXd all;
  std::array<Eigen::MatrixXd, axis_count> own;  // [pieces x pieces] blocks of one axis
  // Of every function on every axis before projection; of a wave with its partner.
  std::array<Eigen::VectorXd, axis_count> function, partner;
  std::shared_ptr<const PieceInformation>
      whole;  // before columns were projected out of all of it; none where none were

 private:
  void of_axis(int axis, const Dictionary& dictionary);
};

// Columns X projected out of the information of a recording, for all models of it whatever their residual is.
struct PieceProjection {
  PieceProjection(std::shared_ptr<const PieceInformation> information, Eigen::MatrixXd columns,
                  const Dictionary& dictionary);

  std::shared_ptr<const PieceInformation> of, left;
  Eigen::MatrixXd X, W;              // W = G X L'^-1
  Eigen::LLT<Eigen::MatrixXd> root;  // L L' = X'G X
};

// Normal equations over the pieces. Laws are vectors over pieces and axes; what was chosen is projected out, what is a
// random process is integrated out.
class PieceModel {
 public:
  PieceModel(const PieceSums& sums, const Dictionary& dictionary);
  // `information`: of these sums.
  PieceModel(const PieceSums& sums, const Dictionary& dictionary, std::shared_ptr<const PieceInformation> information);

  // The function on the axis as a vector over all columns of the sums.
  Eigen::VectorXd column(int axis, const Eigen::Ref<const Eigen::VectorXd>& means) const;
  void choose(const std::vector<Eigen::VectorXd>& columns);
  // Columns that are no vectors over pieces are chosen by their normal equations: those with the pieces, their own, their score.
  void choose(Eigen::MatrixXd with_pieces, Eigen::MatrixXd information, Eigen::VectorXd score);
  // Of another residual of the same recordings. Nothing is chosen then.
  void look_at(Eigen::VectorXd score, double square);
  // The same with these projected out besides, of the information that this model has.
  PieceModel beside(const PieceProjection& columns) const;
  const std::shared_ptr<const PieceInformation>& information() const { return information_; }
  // Columns X become random with covariance q I and are integrated out (Woodbury).
  void integrate_out(const Eigen::MatrixXd& X, double q);

  // Fall of the residuals' square by columns of one axis together, [pieces x columns], given the chosen ones; `least` of a
  // column's information must be left by the projection, or it counts as one that is chosen already.
  double gain(int axis, const Eigen::MatrixXd& means) const;
  // All functions on all axes, largest merit first, at most `most`.
  std::vector<Ranked> rank(std::size_t most) const;
  // Projected information and score of columns of one axis, [k x k] and [k].
  std::pair<Eigen::MatrixXd, Eigen::VectorXd> project(int axis, const Eigen::MatrixXd& means) const;
  // The same of columns of all axes, [pieces x columns] each, in the order of the axes.
  std::pair<Eigen::MatrixXd, Eigen::VectorXd> project(const std::array<Eigen::MatrixXd, axis_count>& means) const;

  double square() const { return square_; }  // of the residuals, the chosen ones' gain taken off

 private:
  // Of a block of functions on one axis, the chosen ones projected out.
  struct BlockSums {
    Eigen::VectorXd score, information, partner;
  };
  void rank_block(int axis, Eigen::Index first, const BlockSums& sums, std::vector<Ranked>& all) const;
  // G X L'^-1, L L' = X'G X: what the chosen ones take of a function's information is the square of its product with these.
  Eigen::MatrixXd chosen_root() const;
  // From information and score of columns, whose products with the chosen ones are `cross`, [chosen x columns].
  void project_out_chosen(const Eigen::MatrixXd& cross, Eigen::MatrixXd& G, Eigen::VectorXd& b) const;
  // Chosen columns by their image, their information and their score.
  void take_off(Eigen::MatrixXd image, Eigen::MatrixXd A, Eigen::VectorXd score);
  // Before what is known was projected out.
  const PieceInformation& whole() const { return information_->whole ? *information_->whole : *information_; }
  Eigen::VectorXd own_score(int axis) const { return score_(Eigen::seqN(axis, sums_.piece_dt.size(), axis_count)); }
  // Rows of one axis of the chosen ones' image.
  Eigen::MatrixXd own_image(int axis) const {
    return chosen_image_(Eigen::seqN(axis, sums_.piece_dt.size(), axis_count), Eigen::all);
  }

  const PieceSums& sums_;
  const Dictionary& dictionary_;
  std::shared_ptr<const PieceInformation> information_;
  Eigen::VectorXd score_;
  double square_ = 0.0, raw_square_ = 0.0;
  Eigen::MatrixXd chosen_, chosen_image_;  // X, none where it is no vector over pieces; G X
  Eigen::MatrixXd chosen_information_;
  Eigen::LDLT<Eigen::MatrixXd> chosen_solver_{Eigen::MatrixXd::Identity(1, 1)};  // not asked while nothing is chosen
  Eigen::VectorXd chosen_score_;
};

}  // namespace selfcal::discovery
