// Nature is never exactly an equation of the catalogue: a strong effect leaves what its form differs by. Columns of such
// forms, with the sizes that the data ask for, are marginalised where a further effect is tested and where what remains is
// judged (Kennedy and O'Hagan, J. R. Statist. Soc. B 63, 2001: a discrepancy orthogonal to what is fitted).
#pragma once

#include <vector>

#include "estimator/diagnosis/regression/evidence.hpp"

namespace selfcal::diagnosis {

// A way to differ from the equation, and by how much of the effect's own size it may (1 sigma).
enum class FormKind { in_turns, constants, time, attitude, rate };

struct FormCandidate {
  FormKind kind = FormKind::in_turns;
  double most = 0.0;    // of the effect's own size, 1 sigma
  Candidate candidate;  // the effect with another constant, or modulated
};

// Forms of a named effect; empty for motion of the base, which the catalogue describes by whole spectra.
std::vector<FormCandidate> forms_of(const Candidate& named);

// Columns of one kind of form of one named effect.
struct FormFamily {
  FormKind kind = FormKind::in_turns;
  std::size_t term = 0;  // of the hypothesis
  double most = 0.0;
  std::vector<int> columns;
  double square = 0.0;  // of the misfit that it takes up
  double scale = 0.0;   // of `most`: of the greatest likelihood, 0: this form is not needed
};

// Forms as marginalised: columns ~ N(0, sigma^2).
struct OpenForms {
  std::vector<FormFamily> families;  // those with a scale
  std::vector<int> columns;
  Eigen::VectorXd sigma;
  double square = 0.0;          // of the misfit that they take up
  double log_likelihood = 0.0;  // gained by them
  Eigen::VectorXd mean;         // given the data and the named effects
  Eigen::MatrixXd covariance;   // the same

  bool empty() const { return columns.empty(); }
};

// The scales of the greatest likelihood, family by family; `named` are fitted too. A family that gains less than the data
// would by chance stays closed.
OpenForms open_forms(const Evidence& evidence, std::vector<FormFamily> families, const std::vector<int>& named);

// What forms that stay closed may still do to the 24: a form that the recording does not show moves them unseen. Covariance, from
// the probability of each scale. `given`: with the open forms marginalised; `shift` of all columns.
ParameterMatrix closed_forms(const Evidence& given, const std::vector<FormFamily>& closed,
                             const std::vector<int>& named, const Eigen::MatrixXd& shift);

}  // namespace selfcal::diagnosis
