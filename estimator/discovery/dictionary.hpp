// The functions that the search tries: products of up to three factors, at most one of which has a constant. A kernel with two quantities has
// fewer constants than one alone, a wave with two is one of at most five periods.
//
// Their values are kept as means over the pieces of the recording; the expression of each is text that laws::Expression
// reads. The cost of a function is the negative logarithm of its probability before any data: the share of belief in its
// kind over the number of functions of that kind and of axes.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "estimator/discovery/pieces.hpp"

namespace selfcal::discovery {

// How a function depends on its constant, if it has one.
enum class Kernel { none, creep, log_creep, warm_up, wave, turn_wave, quotient, step };

struct Factor {
  std::string text;  // of the expression; `?` where the constant stands
  Kernel kernel = Kernel::none;
  double constant = 0.0;  // in the unit of the variable it goes with
};

struct Function {
  std::vector<int> factors;  // of the dictionary
  Kernel kernel = Kernel::none;
  double constant = 0.0;
  int partner = -1;     // of a wave's sine: the function with the cosine in its place, with the same factors
  bool second = false;  // that partner: tried with its sine only
  double cost = 0.0;    // minus the natural logarithm of its probability before any data, over all axes
};

struct Dictionary {
  std::vector<Factor> factors;
  std::vector<Function> functions;
  // [pieces x functions], scaled to a root mean square of 1 over the time. Single precision serves to rank them: what is
  // told is fitted to the recording itself.
  Eigen::MatrixXf means;
  Eigen::VectorXd scale;  // [functions] what they were divided by

  // With `?` for the constant.
  std::string pattern(const Function& function) const;
};

// All functions that this recording distinguishes from a constant and from zero.
Dictionary make_dictionary(const PieceSums& sums, const laws::VariableSet& available);

}  // namespace selfcal::discovery
