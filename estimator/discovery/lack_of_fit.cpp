#include "estimator/discovery/lack_of_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "estimator/diagnosis/regression/regression.hpp"
#include "estimator/laws/expression.hpp"
#include "estimator/statistics/distributions.hpp"

namespace selfcal::discovery {
namespace {

constexpr double questions = 2.0;
// Of what the laws gain: their effect on the 24 is linearised. A law of 527 sigma, its form the true one, left 0.0004.
constexpr double nonlinear_share = 0.001;

Eigen::MatrixXd grouped(const PieceSums& sums, bool with_turns) {
  const auto mean = [&](laws::Variable v) { return sums.means(sums.channels.col(static_cast<Eigen::Index>(v))); };
  const Eigen::VectorXd outer = mean(laws::Variable::outer), inner = mean(laws::Variable::inner);
  const auto rounded = [](double x) { return std::lround(50.0 * x); };  // of a sine or cosine
  std::map<std::array<long, 5>, std::vector<Eigen::Index>> groups;
  for (Eigen::Index p = 0; p < outer.size(); ++p) {
    const Piece& piece = sums.pieces[static_cast<std::size_t>(p)];
    if (!piece.turning) {
      groups[{0, rounded(std::sin(outer(p))), rounded(std::cos(outer(p))), rounded(std::sin(inner(p))),
              rounded(std::cos(inner(p)))}]
          .push_back(p);
    } else if (with_turns) {
      groups[{piece.dwell, 0, 0, 0, 0}].push_back(p);  // a turn is the first thing of its dwell: 1 or more
    }
  }
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(outer.size(), static_cast<Eigen::Index>(groups.size()));
  Eigen::Index column = 0;
  for (const auto& [key, pieces] : groups) {
    means(pieces, column++).setOnes();
  }
  return means;
}

double log_p(const PieceModel& model, int axis, const Eigen::MatrixXd& means, double uncounted) {
  constexpr double widest = 1000.0;  // of columns of information 1 each: directions of less than 1e-6 take no degree
  const auto [G, b] = model.project(axis, means);
  const Eigen::VectorXd scale = G.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const diagnosis::Fit fit =
      diagnosis::fit_columns(scale.asDiagonal() * G * scale.asDiagonal(), scale.cwiseProduct(b), widest);
  return fit.rank > 0 ? log_chi_squared_tail(std::max(0.0, fit.delta_chi2 - uncounted), fit.rank) : 0.0;
}

}  // namespace

Eigen::MatrixXd positions(const PieceSums& sums) { return grouped(sums, false); }
Eigen::MatrixXd positions_and_turns(const PieceSums& sums) { return grouped(sums, true); }

double log_p_of_lack(const PieceModel& model, const PieceSums& sums, int axis, double gained) {
  const double uncounted = nonlinear_share * gained;
  const double least = std::min(log_p(model, axis, positions(sums), uncounted),
                                log_p(model, axis, positions_and_turns(sums), uncounted));
  return std::min(0.0, least + std::log(questions));
}

}  // namespace selfcal::discovery
