// Linear models made by hand: a few columns whose answer can be worked out on paper.
#pragma once

#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {

// Rows = columns * size + unit noise, with the noise left out: what the data are is `made_of`.
inline Evidence evidence_of(const Eigen::MatrixXd& columns, const Eigen::VectorXd& made_of) {
  SignatureRows rows;
  rows.columns = columns;
  rows.residual = made_of;
  return Evidence(rows);
}

// Column of `length` at an angle to the first axis in the plane of the first two.
inline Eigen::VectorXd at_angle(double length, double cosine, Eigen::Index rows) {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(rows);
  column(0) = length * cosine;
  column(1) = length * std::sqrt(1.0 - cosine * cosine);
  return column;
}

inline Effect one_coefficient(const char* id) {
  return {.id = id, .parameters = {{.name = "x", .unit = "1", .si_per_unit = 1.0, .typical = 1.0}}};
}

}  // namespace selfcal::diagnosis
