// Pairs of functions beside the data written out, where one function alone stands for parts of both.
#include "estimator/discovery/two_laws.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/piece_model.hpp"

namespace selfcal::discovery {
namespace {

constexpr Eigen::Index pieces = 12, rows = 150, columns = pieces * axis_count;

// Uniform numbers that are the same on every machine.
Eigen::MatrixXd drawn(Eigen::Index m, Eigen::Index n, unsigned seed) {
  Eigen::MatrixXd A(m, n);
  for (double& x : A.reshaped()) {
    seed = 1664525U * seed + 1013904223U;
    x = static_cast<double>(seed >> 8U) / 16777216.0 - 0.5;
  }
  return A;
}

// Functions 0, 3, 4, 5 and a wave of 1 and 2; what two of them do on axes 1 and 4 is the data.
struct TwoConcealed {
  Eigen::MatrixXd Z = drawn(rows, columns, 1);
  Eigen::VectorXd r;
  PieceSums sums;
  Dictionary dictionary;

  explicit TwoConcealed(int on_both_parts) {
    dictionary.means = drawn(pieces, 6, 3);
    dictionary.functions.resize(6);
    for (int k = 0; k < 6; ++k) {
      dictionary.factors.push_back({std::string(1, static_cast<char>('a' + k)), Kernel::none, 0.0});
      dictionary.functions[static_cast<std::size_t>(k)].factors = {k};
    }
    dictionary.functions[1].partner = 2;
    dictionary.functions[2].second = true;
    // The signature of function 3 on the first axis is half of that of 5 on axis 4 and half of that of 0 on axis 1.
    const Eigen::VectorXd first = signature(1, on_both_parts == 1 ? wave() : Eigen::VectorXd(dictionary.means.col(0)));
    const Eigen::VectorXd second = signature(4, dictionary.means.col(5));
    r = 40.0 * (first.normalized() + second.normalized());
    const Eigen::VectorXd f = dictionary.means.col(3);
    Eigen::VectorXd change = first.normalized() + second.normalized() + 0.05 * drawn(rows, 1, 9) - signature(0, f);
    for (Eigen::Index p = 0; p < pieces; ++p) {
      Z.col(p * axis_count) += f(p) / f.squaredNorm() * change;
    }
    sums.piece_dt = Eigen::VectorXd::Constant(pieces, 60.0);
    sums.pieces.resize(static_cast<std::size_t>(pieces));
    sums.sums.information = Z.transpose() * Z;
    sums.sums.score = Z.transpose() * r;
    sums.sums.square = r.squaredNorm();
  }
  Eigen::VectorXd wave() const { return 0.8 * dictionary.means.col(1) + 0.6 * dictionary.means.col(2); }
  Eigen::VectorXd signature(int axis, const Eigen::VectorXd& f) const {
    const Eigen::MatrixXd of_axis = Z(Eigen::all, Eigen::seqN(axis, pieces, axis_count));
    return of_axis * f;
  }
};

void expect_the_two(const TwoConcealed& d, int first) {
  const PieceModel model(d.sums, d.dictionary);
  const Ranked alone = model.rank(1).front();
  EXPECT_EQ(alone.axis, 0);
  EXPECT_EQ(alone.function, 3);  // what stands for parts of both gains most by itself
  const RankedPair best = rank_pairs(model, d.dictionary, 100).front();
  EXPECT_EQ(best.first.axis, 1);
  EXPECT_EQ(best.first.function, first);
  EXPECT_EQ(best.second.axis, 4);
  EXPECT_EQ(best.second.function, 5);
  // Both together leave nothing. What a wave's phase costs is reckoned in.
  const double costs = 0.5 * best.first.gain - best.first.merit + 0.5 * best.second.gain - best.second.merit;
  EXPECT_NEAR(best.merit + costs, 0.5 * d.r.squaredNorm(), 1e-6 * d.r.squaredNorm());
}

TEST(RankPairs, FindsTwoFunctionsForWhichOneStands) { expect_the_two(TwoConcealed(0), 0); }

TEST(RankPairs, FindsAWaveOfAnyPhaseInAPair) { expect_the_two(TwoConcealed(1), 1); }

// Of any pair, beside what is chosen, the gain is the fall of the square.
TEST(RankPairs, GainsWhatTheSquareFallsBy) {
  const TwoConcealed d(0);
  PieceModel model(d.sums, d.dictionary);
  const Eigen::VectorXd known = drawn(columns, 1, 5);
  model.choose({known});
  const Eigen::MatrixXd Y = d.Z * known;
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(rows, rows) - Y * (Y.transpose() * Y).inverse() * Y.transpose();
  const auto columns_of = [&](const Ranked& ranked) -> Eigen::MatrixXd {
    const Eigen::Index wide = ranked.function == 1 ? 2 : 1;
    const Eigen::MatrixXd of_axis = d.Z(Eigen::all, Eigen::seqN(ranked.axis, pieces, axis_count));
    return rest * of_axis * d.dictionary.means.middleCols(ranked.function, wide);
  };
  const std::vector<RankedPair> pairs = rank_pairs(model, d.dictionary, 100);
  ASSERT_GT(pairs.size(), 10U);
  for (const RankedPair& pair : pairs) {
    const Eigen::MatrixXd a = columns_of(pair.first), b = columns_of(pair.second);
    Eigen::MatrixXd both(rows, a.cols() + b.cols());
    both << a, b;
    const Eigen::VectorXd score = both.transpose() * d.r;
    const double gain = score.dot((both.transpose() * both).ldlt().solve(score));
    const double costs = 0.5 * pair.first.gain - pair.first.merit + 0.5 * pair.second.gain - pair.second.merit;
    EXPECT_NEAR(pair.merit + costs, 0.5 * gain, 1e-4 * gain);  // the gain of one alone is in single precision
  }
}

}  // namespace
}  // namespace selfcal::discovery
