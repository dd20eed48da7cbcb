// Squares of the components of gravity. They add up to a constant: an accelerometer that errs with the square of its own force puts out what a
// bias and the squares of the other two do, and no recording in which gravity alone loads it tells them apart. Where two such squares are named
// of an accelerometer, one of them and the square of its own force say it in as few words, with another bias.
#pragma once

#include <Eigen/Core>

#include "estimator/diagnosis/regression/hypothesis.hpp"
#include "estimator/models/sensor_model.hpp"

namespace selfcal::diagnosis {

// Over all explanations of each accelerometer that have at most two of the three squares, weighed by BIC: to be added to the 24 and their
// covariance beside the term as it is named.
struct SquaresAverage {
  ParameterVector shift = ParameterVector::Zero();  // SI
  ParameterMatrix covariance = ParameterMatrix::Zero();
  double own_square = 0.0;  // probability that some accelerometer errs with the square of its own force
};

// `squares`: of the effect with those of the other axes. `shift`: [24 x 6] of the 24 per typical size of each. `rows`: of
// the evidence.
SquaresAverage average_squares(const Term& squares, const Eigen::MatrixXd& shift, double rows);

}  // namespace selfcal::diagnosis
