// Random processes on one axis: a jump at each turn, a random walk of the bias.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "estimator/discovery/piece_model.hpp"

namespace selfcal::discovery {

enum class ProcessKind { jump_per_turn, random_walk };
// As in a law's `process`.
constexpr std::string_view name_of(ProcessKind kind) {
  return kind == ProcessKind::jump_per_turn ? "jump per turn" : "random walk";
}

constexpr double process_count = 2.0 * axis_count;  // kinds on axes

struct ProcessFit {
  ProcessKind kind = ProcessKind::jump_per_turn;
  int axis = 0;
  double log_likelihood_gain = 0.0;
  double ahead = 0.0;                 // of the other kind's gain on the axis (likelier_process)
  double half_log_determinant = 0.0;  // what its freedom costs: half the logarithm of |1 + size^2 X'GX|
  double size = 0.0, sigma = 0.0;     // standard deviation of a jump, or per sqrt(h); in unit_of(axis)
  Eigen::MatrixXd columns;            // independent draws of unit variance, over the columns of the sums
};

// The size of greatest likelihood, given what the model has chosen.
ProcessFit fit_process(const PieceModel& model, const PieceSums& sums, ProcessKind kind, int axis);
// The likelier kind on this axis.
ProcessFit likelier_process(const PieceModel& model, const PieceSums& sums, int axis);
// Fall of the square of the model's residual by this process at its size.
double absorbed(const PieceModel& model, const ProcessFit& process);

}  // namespace selfcal::discovery
