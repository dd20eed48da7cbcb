// Pairs of functions beside the data written out, where one function alone stands for parts of both.
#include "estimator/discovery/two_laws.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <string>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "tests/unit/discovery/drawn.hpp"

namespace selfcal::discovery {
namespace {

constexpr Eigen::Index pieces = 12, rows = 150, columns = pieces * axis_count;

// Functions 0, 3, 4, 5 and a wave of 1 and 2. The data are what function 0 or the wave does on axis 1 and 5 on axis 4.
struct TwoConcealed {
  Eigen::MatrixXd Z = drawn(rows, columns, 1);
  Eigen::VectorXd r;
  PieceSums sums;
  Dictionary dictionary;

  explicit TwoConcealed(bool a_wave) {
    dictionary.means = drawn(pieces, 6, 3).cast<float>();
    dictionary.functions.resize(6);
    for (int k = 0; k < 6; ++k) {
      dictionary.factors.push_back({std::string(1, static_cast<char>('a' + k)), Kernel::none, 0.0});
      dictionary.functions[static_cast<std::size_t>(k)].factors = {k};
    }
    dictionary.functions[1].partner = 2;
    dictionary.functions[2].second = true;
    // The signature of function 3 on the first axis becomes the sum of both and a little more.
    const Eigen::VectorXd first =
        signature(1, a_wave ? wave() : Eigen::VectorXd(dictionary.means.col(0).cast<double>()));
    const Eigen::VectorXd second = signature(4, dictionary.means.col(5).cast<double>());
    r = 40.0 * (first.normalized() + second.normalized());
    const Eigen::VectorXd f = dictionary.means.col(3).cast<double>();
    const Eigen::VectorXd change =
        first.normalized() + second.normalized() + 0.05 * drawn(rows, 1, 9) - signature(0, f);
    for (Eigen::Index p = 0; p < pieces; ++p) {
      Z.col(p * axis_count) += f(p) / f.squaredNorm() * change;
    }
    sums = sums_of(Z, r);
  }
  Eigen::VectorXd wave() const {
    return 0.8 * dictionary.means.col(1).cast<double>() + 0.6 * dictionary.means.col(2).cast<double>();
  }
  Eigen::VectorXd signature(int axis, const Eigen::VectorXd& f) const { return of_axis(Z, axis) * f; }
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

TEST(RankPairs, FindsTwoFunctionsForWhichOneStands) { expect_the_two(TwoConcealed(false), 0); }

TEST(RankPairs, FindsAWaveOfAnyPhaseInAPair) { expect_the_two(TwoConcealed(true), 1); }

// Of any pair, beside what is chosen, the gain is the fall of the square.
TEST(RankPairs, GainsWhatTheSquareFallsBy) {
  const TwoConcealed d(false);
  PieceModel model(d.sums, d.dictionary);
  const Eigen::VectorXd known = drawn(columns, 1, 5);
  model.choose({known});
  const Eigen::MatrixXd Y = d.Z * known;
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(rows, rows) - Y * (Y.transpose() * Y).inverse() * Y.transpose();
  const auto columns_of = [&](const Ranked& ranked) -> Eigen::MatrixXd {
    const Eigen::Index wide = ranked.function == 1 ? 2 : 1;
    return rest * of_axis(d.Z, ranked.axis) * d.dictionary.means.middleCols(ranked.function, wide).cast<double>();
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
