// Slow noise of blocks' means, and what stands beside it. Private to this folder.
//
// Covariance of the means of n blocks of length b, in units of a block's white noise, by grid points (f, q):
//   (N1) V = diag(1) + f sum_m C(tau_m) + q W
//   (N2) C(tau): a first-order process of unit variance, averaged over the blocks; tau_m = b 3^m from a block to ten times the log.
//        Their sum has a spectrum of 1/f there (van der Ziel 1950).
//   (N3) W: a random walk, pinned at a block's edge in the middle of the longest pose: the constant is the bias there.
// The scale of V is profiled. Which (f, q) is true the blocks tell badly, and a drift is judged by that above all: every answer is
// averaged over the grid by restricted likelihood, tails included. The greatest one alone would understate sigma.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace selfcal::diagnosis {

struct BlockTimes {
  Eigen::VectorXd middle_s, weight;  // weight: share of a block's samples that are used
  double block_s = 0.0;
  double pin_s = 0.0;
};

class SlowNoise {
 public:
  // Columns are all that is ever asked: readings, constants, equations.
  SlowNoise(const BlockTimes& times, const Eigen::MatrixXd& columns);

  struct Answer {
    Eigen::VectorXd value, sigma;         // of the known columns and, last, the one asked about
    double log_p = 0.0;                   // of the last one, two-sided
    double log_likelihood = 0.0;          // of the best grid point, of the residuals alone
    double walk = 0.0, walk_sigma = 0.0;  // density, unit of the reading / sqrt(s)
    double walk_odds = 0.0;               // that there is one, logarithm
  };
  // Columns `known` fitted to column `reading`.
  Answer ask(const std::vector<Eigen::Index>& known, Eigen::Index reading) const;

 private:
  struct Point {
    double walk = 0.0;  // q
    double log_prior = 0.0;
    double half_log_det = 0.0;
    Eigen::MatrixXd gram;
  };
  std::vector<Point> points_;
  Eigen::Index rows_ = 0;
  double block_s_ = 0.0;
};

}  // namespace selfcal::diagnosis
