// A recording linearised: residuals as columns times sizes plus unit noise.
#pragma once

#include <vector>

#include "estimator/diagnosis/corrected_recording.hpp"
#include "estimator/diagnosis/evidence.hpp"

namespace selfcal::diagnosis {

// Where a recording is linearised: parameters, attitude and noise, and the increments less what was taken out of them.
struct OperatingPoint {
  PassInput input;  // its `data` is not used
  CorrectedRecording recording;

  PassInput pass() const;  // a forward pass; the point must outlive it
};

// The point that the 24 settle at with `correction` taken out of the context's recording.
OperatingPoint settle(const RecordingContext& context, const OperatingPoint& from, Correction correction);

// The one place that makes normal equations of a recording. What was taken out of the increments counts as still in them, with
// the constants it was taken out with; random walks are marginalised.
class LinearModel {
 public:
  // Columns: those of `candidates`, then with `map` those of where a bias may be off (at any rate where there are walks).
  static LinearModel about(const RecordingContext& context, const OperatingPoint& point,
                           std::vector<Candidate> candidates, const std::vector<WalkTest>& walks, bool map);

  const std::vector<Candidate>& candidates() const { return candidates_; }  // with their columns
  const std::vector<LocatedColumn>& map() const { return map_; }
  int first_map_column() const { return first_map_column_; }
  const SignatureRows& rows() const { return rows_; }
  const Evidence& evidence() const { return evidence_; }
  // Walks not marginalised.
  Evidence evidence_without_walks() const;
  // Of the recording with what was taken out.
  Eigen::VectorXd residual() const;
  // The same less columns `fitted` at their best sizes, `known` ones at theirs, and the walks' own estimate.
  Eigen::VectorXd residual_after(const std::vector<int>& fitted, const std::vector<int>& known = {},
                                 const Eigen::VectorXd& known_size = {}) const;
  // Of the recording with columns `fitted` at their best sizes, walks marginalised.
  double log_likelihood(const std::vector<int>& fitted) const;
  // Estimate of the 24 with these sizes of `columns`: truth = estimate + shift * (size - what was taken out).
  ParameterVector parameters(const std::vector<int>& columns, const Eigen::VectorXd& size) const;

  void marginalise(const WalkTest& walk);
  // These walks, and no others.
  void marginalise(std::vector<WalkTest> walks);
  // Further columns [rows x n] and what they shift the 24 by [24 x n]. Returns where they begin.
  int append(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& shift);
  // Columns `more` of the same point combined by `combine`, one row each of what is appended.
  int append(const RecordingContext& context, const OperatingPoint& point, const std::vector<Candidate>& more,
             const Eigen::MatrixXd& combine);

 private:
  std::vector<int> columns_of_walk(const WalkTest& walk) const;
  Evidence marginalised() const;

  std::vector<Candidate> candidates_;
  std::vector<LocatedColumn> map_;
  int first_map_column_ = 0;
  ParameterVector linearisation_ = ParameterVector::Zero();
  SignatureRows rows_;
  std::vector<int> taken_out_;  // columns, and how much of them
  Eigen::VectorXd taken_out_size_;
  std::vector<WalkTest> walks_;
  Evidence evidence_;
};

}  // namespace selfcal::diagnosis
