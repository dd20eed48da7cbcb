// Signatures and data drawn at random, and the sums over pieces that a recording with them would give.
#pragma once

#include <Eigen/Core>

#include "estimator/discovery/pieces.hpp"

namespace selfcal::discovery {

// Uniform numbers that are the same on every machine.
inline Eigen::MatrixXd drawn(Eigen::Index m, Eigen::Index n, unsigned seed) {
  Eigen::MatrixXd A(m, n);
  for (double& x : A.reshaped()) {
    seed = 1664525U * seed + 1013904223U;
    x = static_cast<double>(seed >> 8U) / 16777216.0 - 0.5;
  }
  return A;
}

// Twelve of them added up: normal with mean 0 and variance 1 but for the tails beyond 3 sigma.
inline Eigen::VectorXd drawn_normal(Eigen::Index n, unsigned seed) { return drawn(n, 12, seed).rowwise().sum(); }

// Z: a column for every axis of every piece; r: the data.
inline PieceSums sums_of(const Eigen::MatrixXd& Z, const Eigen::VectorXd& r) {
  const Eigen::Index pieces = Z.cols() / axis_count;
  PieceSums sums;
  sums.piece_dt = Eigen::VectorXd::Constant(pieces, 60.0);
  sums.pieces.resize(static_cast<std::size_t>(pieces));
  sums.sums.information = Z.transpose() * Z;
  sums.sums.score = Z.transpose() * r;
  sums.sums.square = r.squaredNorm();
  return sums;
}

// Signatures of the bias of one axis in every piece, [rows x pieces].
inline Eigen::MatrixXd of_axis(const Eigen::MatrixXd& Z, int axis) {
  return Z(Eigen::all, Eigen::seqN(axis, Z.cols() / axis_count, axis_count));
}

}  // namespace selfcal::discovery
