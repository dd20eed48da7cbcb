// A forward pass of the calibration filter that carries any number of signature columns and sums their normal equations.
//
// The recursion is that of diagnosis/signature_pass.hpp (Willsky and Jones 1976); here the rows are summed as they come, so
// that a thousand columns need no memory for rows.
#pragma once

#include <Eigen/Core>
#include <array>
#include <stop_token>
#include <vector>

#include "estimator/passes/pass.hpp"

namespace selfcal::discovery {

class ColumnSource : public ExtraSignatures {
 public:
  // Columns behind this one have been zero so far, at this time since the start: they need no work yet.
  virtual int active(double time_s) const = 0;
};

// The filter's side of a pass. It is the same whatever columns are carried, so that passes about one linearisation need it once.
struct PassTrace {
  struct Update {
    int axis = 0;
    ScalarInnovation innovation;
    VectorX gain;  // [states]
  };
  std::vector<int> observed;  // [intervals] scalar observations behind each
  std::vector<Update> updates;
  std::array<VectorX, 3> h;  // observation row of each axis, [dynamic states]
  PassOutput pass;
};
PassTrace trace_pass(const PassInput& input, const std::stop_token& stop = {});

struct ColumnSums {
  Eigen::MatrixXd information;  // [n x n] sum of row^T row, rows of unit noise with the 33 states projected out
  Eigen::VectorXd score;        // [n]
  double square = 0.0;          // of the residual
  double rows = 0.0;
  double log_determinant = 0.0;  // of the innovations' covariance
  Eigen::MatrixXd shift;         // [24 x n] truth minus estimate of the 24 per unit of a column
  PassOutput pass;
};

struct RowSink {
  Eigen::MatrixXd columns;     // [rows x n]
  Eigen::VectorXd residual;    // [rows]
  std::vector<double> time_s;  // [rows] middle of the interval, recording's time
};

// x of least |x| in units of the columns' lengths with information * x = b, columns of b: collinear ones count once.
Eigen::MatrixXd solve_scaled(const Eigen::MatrixXd& information, const Eigen::MatrixXd& b);

// Columns from `first` on, `count` of them, projected out as the 33 states are: what is left are the sums of a filter that has their
// coefficients among its states, unknown before. So are the rows of the sink. Collinear ones count once.
ColumnSums project_out(const ColumnSums& sums, int first, int count, RowSink* rows = nullptr);

// With `rows` the rows are kept too (few columns only). `trace`: of a pass with this input.
ColumnSums run_columns(const PassInput& input, const PassTrace& trace, ColumnSource& source,
                       const std::stop_token& stop = {}, RowSink* rows = nullptr);
ColumnSums run_columns(const PassInput& input, ColumnSource& source, const std::stop_token& stop = {},
                       RowSink* rows = nullptr);

}  // namespace selfcal::discovery
