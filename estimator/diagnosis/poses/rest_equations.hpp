// Equations that change while nothing turns, as columns over a log's blocks. Private to this folder.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimator/diagnosis/poses/rest.hpp"
#include "estimator/diagnosis/poses/rest_blocks.hpp"

namespace selfcal::diagnosis {

// An equation with its columns, one a time constant; of unit length, without the poses' means.
struct RestCandidate {
  RestEquation equation;
  Eigen::MatrixXd columns;
  std::vector<double> length, constant;  // length: what a column was divided by
  bool after_linear = false;             // asked once the temperature itself is named
  bool is_linear = false;
  std::vector<std::string> twins;  // where gravity acts along the axis
  double tests = 1.0;              // that the constants are worth
  double apart_s = 0.0;            // of the times of a jump; 0: time constants, 26 % apart
  std::vector<Eigen::Index> at;    // columns of a table that holds them: whoever makes it
};

// The catalogue's of one triad, the simpler one first, then those of the temperature that it does not hold.
std::vector<RestCandidate> equations_at_rest(const RestBlocks& blocks, bool gyro);

}  // namespace selfcal::diagnosis
