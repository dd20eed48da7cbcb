#include "estimator/diagnosis/search/stage.hpp"

#include <algorithm>
#include <utility>

namespace selfcal::diagnosis {
namespace {

constexpr int most_rounds = 4;
constexpr double converged_sigma = 0.1;

double largest_move(const Hypothesis& before, const Hypothesis& after) {
  double move = 0.0;
  for (std::size_t i = 0; i < after.terms.size(); ++i) {
    const Eigen::VectorXd sigma = after.terms[i].covariance.diagonal().cwiseSqrt();
    const Eigen::VectorXd moved = after.terms[i].amplitude - before.terms[i].amplitude;
    move = std::max(move, moved.cwiseAbs().cwiseQuotient(sigma).maxCoeff());
  }
  return move;
}

}  // namespace

Stage linearised(const RecordingContext& context, const OperatingPoint& point, Selection selection) {
  LinearModel model = LinearModel::about(context, point, selection.hypothesis, selection.alternatives, true);
  return {std::move(selection), point, std::move(model), {}};
}

Stage settled(const RecordingContext& context, const Stage& from, Selection selection) {
  selection.hypothesis = from.model.fitted(std::move(selection.hypothesis));
  OperatingPoint point = from.point;
  for (int round = 1;; ++round) {
    point = settle(context, point, selection.hypothesis);
    Stage stage = linearised(context, point, selection);
    selection.hypothesis = stage.model.fitted(std::move(selection.hypothesis));
    const double move = largest_move(stage.hypothesis(), selection.hypothesis);
    if (round == most_rounds || point.recording.taken_out().effects.empty() || move < converged_sigma) {
      stage.selection = std::move(selection);
      return with_forms(context, std::move(stage));
    }
  }
}

}  // namespace selfcal::diagnosis
