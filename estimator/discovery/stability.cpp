#include "estimator/discovery/stability.hpp"

#include <random>

namespace selfcal::discovery {
namespace {

constexpr int draws = 40;
constexpr unsigned left_out_one_in = 4;
constexpr unsigned seed = 20261123;

struct Sums {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
};

// Of each dwell and each rotation of one recording.
std::vector<Sums> sums_of_parts(const LawRecording& recording, const std::vector<LawTerm>& terms,
                                const std::stop_token& stop) {
  LawColumns source(recording.motion, recording.table, terms, false);
  RowSink rows;
  run_beside(recording.beside, recording.motion.context(), recording.input, recording.trace, source, stop, &rows);
  const auto n = static_cast<Eigen::Index>(terms.size());
  std::vector<Sums> parts;
  for (Eigen::Index first = 0; first < rows.residual.size();) {
    const std::size_t part = recording.motion.context().segment_at(rows.time_s[static_cast<std::size_t>(first)]);
    Eigen::Index end = first;
    while (end < rows.residual.size() &&
           recording.motion.context().segment_at(rows.time_s[static_cast<std::size_t>(end)]) == part) {
      ++end;
    }
    const auto X = rows.columns.middleRows(first, end - first);
    parts.push_back({Eigen::MatrixXd::Zero(n, n), X.transpose() * rows.residual.segment(first, end - first)});
    parts.back().information.selfadjointView<Eigen::Lower>().rankUpdate(X.transpose());
    parts.back().information = parts.back().information.selfadjointView<Eigen::Lower>();
    first = end;
  }
  return parts;
}

// The candidate of greatest merit; columns of `given` stand before those of the candidates.
std::size_t best_in(const Sums& sums, Eigen::Index given, const std::vector<Candidate>& candidates) {
  Eigen::MatrixXd A = sums.information.topLeftCorner(given, given);
  A.diagonal() *= 1.0 + 1e-9;
  const Eigen::LDLT<Eigen::MatrixXd> solver(A);
  std::size_t best = 0;
  double best_merit = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const Eigen::Index column = given + static_cast<Eigen::Index>(k);
    const Eigen::VectorXd cross = sums.information.col(column).head(given);
    const Eigen::VectorXd solved = given > 0 ? Eigen::VectorXd(solver.solve(cross)) : Eigen::VectorXd();
    const double information = sums.information(column, column) - (given > 0 ? cross.dot(solved) : 0.0);
    const double score = sums.score(column) - (given > 0 ? solved.dot(sums.score.head(given)) : 0.0);
    const double merit =
        information > 0.0 ? 0.5 * score * score / information - candidates[k].cost : -candidates[k].cost;
    if (merit > best_merit) {
      best_merit = merit;
      best = k;
    }
  }
  return best;
}

}  // namespace

double stability(std::span<const LawRecording> recordings, const std::vector<LawTerm>& given,
                 const std::vector<Candidate>& candidates, std::size_t members, const std::stop_token& stop) {
  std::vector<LawTerm> terms = given;
  for (const Candidate& c : candidates) {
    terms.push_back(c.term);
  }
  std::vector<Sums> parts;
  for (const LawRecording& recording : recordings) {
    for (Sums& part : sums_of_parts(recording, terms, stop)) {
      parts.push_back(std::move(part));
    }
  }
  std::mt19937 engine(seed);  // the standard fixes its bits
  const auto n = static_cast<Eigen::Index>(terms.size());
  int kept = 0;
  for (int draw = 0; draw < draws; ++draw) {
    Sums sum{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
    for (const Sums& part : parts) {
      if (engine() % left_out_one_in != 0) {
        sum.information += part.information;
        sum.score += part.score;
      }
    }
    kept += best_in(sum, static_cast<Eigen::Index>(given.size()), candidates) < members ? 1 : 0;
  }
  return static_cast<double>(kept) / draws;
}

}  // namespace selfcal::discovery
