// A recording linearised about a hypothesis: residuals as columns times sizes plus unit noise.
#pragma once

#include <memory>
#include <vector>

#include "estimator/diagnosis/regression/corrected_recording.hpp"
#include "estimator/diagnosis/regression/hypothesis.hpp"

namespace selfcal::diagnosis {

// Where a recording is linearised: parameters and attitude, and the increments less what was taken out of them.
struct OperatingPoint {
  PassInput input;  // its `data` and `noise` are not used
  CorrectedRecording recording;

  PassInput pass(const NoiseModel& noise) const;  // a forward pass; the point must outlive it
};

// Moves the linearisation (parameters and attitude at the start) of a forward pass to where passes there and back in its own noise end, two of
// each; not one that is held.
void settle(PassInput& input);

// The point that the 24 settle at with the hypothesis' terms taken out of the context's recording.
OperatingPoint settle(const RecordingContext& context, const OperatingPoint& from, const Hypothesis& hypothesis);

// The one place that makes normal equations of a recording, and the only one that numbers columns. What was taken out of the
// increments counts as still in them, with the constants it was taken out with.
class LinearModel {
 public:
  // Columns: those of `alternatives`, those of terms that are not among them, then with `map` those of where a bias may be off.
  static LinearModel about(const RecordingContext& context, const OperatingPoint& point, const Hypothesis& hypothesis,
                           const std::vector<Variant>& alternatives, bool map);

  const std::vector<Candidate>& alternatives() const {
    return alternatives_;
  }                                                               // with their columns, in the order given
  const std::vector<Candidate>& terms() const { return terms_; }  // of the hypothesis
  // Of another hypothesis, whose variants have columns here: at the constants that they have here.
  std::vector<Candidate> terms_of(const Hypothesis& other) const;
  const std::vector<LocatedColumn>& map() const { return map_; }
  int first_map_column() const { return first_map_column_; }
  const SignatureRows& rows() const { return *rows_; }
  const Evidence& evidence() const { return evidence_; }

  // Given the hypothesis.
  GroupTest test(const Candidate& alternative) const;
  // `h` with the amplitudes of the greatest likelihood.
  Hypothesis fitted(Hypothesis h) const;
  // Of the recording with the terms at their best sizes.
  double log_likelihood() const;
  // Of the recording with what was taken out.
  Eigen::VectorXd residual() const;
  // The same less columns `fitted` at their best sizes, `known` ones at theirs.
  Eigen::VectorXd residual_after(const std::vector<int>& fitted, const std::vector<int>& known = {},
                                 const Eigen::VectorXd& known_size = {}) const;
  // Estimate of the 24 with these sizes of `columns`: truth = estimate + shift * (size - what was taken out).
  ParameterVector parameters(const std::vector<int>& columns = {}, const Eigen::VectorXd& size = {}) const;
  // Of the 24, given the columns' sizes.
  ParameterMatrix covariance() const;

  // Further columns [rows x n] and what they shift the 24 by [24 x n]. Returns where they begin.
  int append(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& shift);

 private:
  std::vector<Variant> variants_;  // with columns: alternatives, other terms
  std::vector<Candidate> candidates_, alternatives_, terms_;
  std::vector<LocatedColumn> map_;
  int first_map_column_ = 0;
  ParameterVector linearisation_ = ParameterVector::Zero();
  std::shared_ptr<const SignatureRows> rows_;
  std::vector<int> taken_out_;  // columns, and how much of them
  Eigen::VectorXd taken_out_size_;
  Evidence evidence_;
};

}  // namespace selfcal::diagnosis
