#include "estimator/discovery/process.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace selfcal::discovery {
namespace {

constexpr double seconds_per_hour = 3600.0;

// [pieces x dwells] one column a dwell: the offset that holds from the start of a turn to that of the next.
Eigen::MatrixXd jumps(const PieceSums& sums) {
  const int count = sums.pieces.back().dwell + 1;
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(sums.piece_dt.size(), count);
  for (Eigen::Index p = 0; p < means.rows(); ++p) {
    means(p, sums.pieces[static_cast<std::size_t>(p)].dwell) = 1.0;
  }
  return means;
}

// [pieces x increments] from the middle of a piece to that of the next of the same recording, of its share of the variance
// per hour.
Eigen::MatrixXd increments(const PieceSums& sums) {
  const auto n = sums.piece_dt.size();
  const auto piece = [&](Eigen::Index p) { return sums.pieces[static_cast<std::size_t>(p)]; };
  const auto middle = [&](Eigen::Index p) { return 0.5 * (piece(p).start_s + piece(p).end_s) / seconds_per_hour; };
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(n, n - 1);
  Eigen::Index column = 0;
  for (Eigen::Index k = 1; k < n; ++k) {
    Eigen::Index end = k;
    for (; end < n && piece(end).recording == piece(k - 1).recording; ++end) {
    }
    if (end > k) {
      means.col(column++).segment(k, end - k).setConstant(std::sqrt(middle(k) - middle(k - 1)));
    }
  }
  return means.leftCols(column);
}

}  // namespace

ProcessFit fit_process(const PieceModel& model, const PieceSums& sums, ProcessKind kind, int axis) {
  ProcessFit fit;
  fit.kind = kind;
  fit.axis = axis;
  const Eigen::MatrixXd means = kind == ProcessKind::jump_per_turn ? jumps(sums) : increments(sums);
  fit.columns = Eigen::MatrixXd::Zero(sums.sums.score.size(), means.cols());
  fit.columns(Eigen::seqN(axis, means.rows(), axis_count), Eigen::all) = means;
  const auto [J, b] = model.project(axis, means);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(J);
  const Eigen::ArrayXd d = eigen.eigenvalues().array().max(0.0);
  const Eigen::ArrayXd u2 = (eigen.eigenvectors().transpose() * b).array().square();
  // log L(q) - log L(0) of columns ~ N(0, q): 1/2 sum q u^2/(1 + q d) - 1/2 sum log(1 + q d).
  const auto gain = [&](double log_q) {
    const double q = std::exp(log_q);
    return 0.5 * (q * u2 / (1.0 + q * d) - (1.0 + q * d).log()).sum();
  };
  constexpr double low = -14.0, step = 0.1;
  constexpr int steps = 300;
  double best = low;
  for (int k = 0; k <= steps; ++k) {
    const double x = low + step * k;
    best = gain(x) > gain(best) ? x : best;
  }
  fit.log_likelihood_gain = std::max(0.0, gain(best));
  fit.size = std::exp(0.5 * best);
  fit.half_log_determinant = 0.5 * (1.0 + std::exp(best) * d).log().sum();
  const double curvature = (gain(best + step) + gain(best - step) - 2.0 * gain(best)) / (step * step);
  fit.sigma = 0.5 * fit.size / std::sqrt(std::max(-curvature, 1e-6));
  return fit;
}

ProcessFit likelier_process(const PieceModel& model, const PieceSums& sums, int axis) {
  ProcessFit jump = fit_process(model, sums, ProcessKind::jump_per_turn, axis);
  ProcessFit walk = fit_process(model, sums, ProcessKind::random_walk, axis);
  const double ahead = jump.log_likelihood_gain - walk.log_likelihood_gain;
  ProcessFit likelier = ahead > 0.0 ? std::move(jump) : std::move(walk);
  likelier.ahead = std::abs(ahead);
  return likelier;
}

double absorbed(const PieceModel& model, const ProcessFit& process) {
  const Eigen::MatrixXd means =
      process.columns(Eigen::seqN(process.axis, process.columns.rows() / axis_count, axis_count), Eigen::all);
  auto [J, b] = model.project(process.axis, means);
  J.diagonal().array() += 1.0 / (process.size * process.size);
  return b.dot(J.ldlt().solve(b));
}

}  // namespace selfcal::discovery
