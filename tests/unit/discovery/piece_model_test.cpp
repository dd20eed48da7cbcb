// Gains over the pieces beside the covariance of the data written out, a random process in it.
#include "estimator/discovery/piece_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "tests/unit/discovery/drawn.hpp"

namespace selfcal::discovery {
namespace {

constexpr Eigen::Index pieces = 8, rows = 100, columns = pieces * axis_count;
constexpr double q = 0.7;

struct Drawn {
  Eigen::MatrixXd Z = drawn(rows, columns, 1);
  Eigen::VectorXd r = drawn(rows, 1, 2);
  PieceSums sums = sums_of(Z, r);
  Dictionary dictionary;

  Drawn() {
    dictionary.means = drawn(pieces, 4, 3).cast<float>();
    dictionary.functions.resize(4);
    dictionary.functions[1].partner = 2;  // a wave
    dictionary.functions[2].second = true;
  }
  // Fall of the square of the data's residual, weighted by their covariance, by functions of one axis.
  double gain(const Eigen::MatrixXd& covariance, int axis, const Eigen::MatrixXd& functions) const {
    const Eigen::MatrixXd signatures = of_axis(Z, axis) * functions;
    const Eigen::MatrixXd weighted = covariance.inverse() * signatures;
    const Eigen::VectorXd b = weighted.transpose() * r;
    return b.dot((signatures.transpose() * weighted).ldlt().solve(b));
  }
};

void expect_gains(const Drawn& d, const PieceModel& model, const Eigen::MatrixXd& covariance) {
  std::map<std::pair<int, int>, double> gains;
  for (const Ranked& ranked : model.rank(100)) {
    gains[{ranked.axis, ranked.function}] = ranked.gain;
  }
  ASSERT_EQ(gains.size(), 3U * axis_count);  // a wave's cosine is no function by itself
  const Eigen::MatrixXd D = d.dictionary.means.cast<double>();
  for (int axis = 0; axis < axis_count; ++axis) {
    // Products with a function are in single precision, 6e-8 each: of its information that counts to the gain, of its score to the root of
    // the gain and of the residual's square.
    constexpr double rounding = 1e-6;
    const double square = d.r.dot(covariance.inverse() * d.r);
    for (const auto& [function, its] :
         {std::pair{0, D.middleCols(0, 1)}, {1, D.middleCols(1, 2)}, {3, D.middleCols(3, 1)}}) {
      const double gain = d.gain(covariance, axis, its);
      EXPECT_NEAR((gains[{axis, function}]), gain, rounding * (gain + std::sqrt(gain * square)));
    }
  }
  EXPECT_NEAR(model.square(), d.r.dot(covariance.inverse() * d.r), 1e-9);
}

TEST(PieceModel, RanksByTheFallOfTheSquare) {
  const Drawn d;
  expect_gains(d, PieceModel(d.sums, d.dictionary), Eigen::MatrixXd::Identity(rows, rows));
}

// A process of few columns is taken off the functions' information, with one of many it is reckoned anew.
TEST(PieceModel, IntegratesAProcessOut) {
  const Drawn d;
  for (const Eigen::Index count : {2, 3, 6}) {
    const Eigen::MatrixXd X = drawn(columns, count, 4);
    PieceModel model(d.sums, d.dictionary);
    model.integrate_out(X, q);
    const Eigen::MatrixXd random = d.Z * X;
    expect_gains(d, model, Eigen::MatrixXd::Identity(rows, rows) + q * random * random.transpose());
    model.integrate_out(drawn(columns, 2, 5), q);  // and another one beside it
    const Eigen::MatrixXd more = d.Z * drawn(columns, 2, 5);
    expect_gains(d, model,
                 Eigen::MatrixXd::Identity(rows, rows) + q * random * random.transpose() + q * more * more.transpose());
  }
}

// Models of one information have residuals of their own.
TEST(PieceModel, SharesTheInformationOfARecording) {
  Drawn d;
  const auto information = std::make_shared<const PieceInformation>(d.sums.sums.information, d.dictionary);
  PieceModel first(d.sums, d.dictionary, information);
  first.integrate_out(drawn(columns, 2, 4), q);
  d.r = drawn(rows, 1, 6);
  d.sums.sums.score = d.Z.transpose() * d.r;
  d.sums.sums.square = d.r.squaredNorm();
  expect_gains(d, PieceModel(d.sums, d.dictionary, information), Eigen::MatrixXd::Identity(rows, rows));
}

// Columns that are no functions over the pieces, as an effect's are that changes within one, are projected out by their normal equations.
TEST(PieceModel, ProjectsOutWhatIsNoVectorOverPieces) {
  const Drawn d;
  const Eigen::MatrixXd Y = drawn(rows, 3, 7);
  PieceModel model(d.sums, d.dictionary);
  model.choose(d.Z.transpose() * Y, Y.transpose() * Y, Y.transpose() * d.r);
  const Eigen::MatrixXd projector = Y * (Y.transpose() * Y).inverse() * Y.transpose();
  const Eigen::VectorXd left = d.r - projector * d.r;
  for (const Ranked& ranked : model.rank(100)) {
    if (ranked.function == 1) {
      continue;  // with its partner
    }
    const Eigen::VectorXd f = of_axis(d.Z, ranked.axis) * d.dictionary.means.col(ranked.function).cast<double>();
    const Eigen::VectorXd rest = f - projector * f;
    const double gain = rest.dot(left) * rest.dot(left) / rest.squaredNorm();
    EXPECT_NEAR(ranked.gain, gain, 1e-6 * std::max(1.0, gain));  // single precision
  }
  EXPECT_NEAR(model.square(), left.squaredNorm(), 1e-7);
}

TEST(PieceModel, ProjectsFunctionsOfAllAxes) {
  const Drawn d;
  PieceModel model(d.sums, d.dictionary);
  const Eigen::VectorXd known = drawn(columns, 1, 5);
  model.choose({known});
  std::array<Eigen::MatrixXd, axis_count> means;
  Eigen::MatrixXd all(rows, 0);
  for (int axis = 0; axis < axis_count; ++axis) {
    const Eigen::Index its = axis % 3;  // of some axes none
    means[static_cast<std::size_t>(axis)] = drawn(pieces, its, 20U + static_cast<unsigned>(axis));
    all.conservativeResize(rows, all.cols() + its);
    all.rightCols(its) = of_axis(d.Z, axis) * means[static_cast<std::size_t>(axis)];
  }
  const Eigen::VectorXd y = d.Z * known;
  const Eigen::MatrixXd rest = all - y * (y.transpose() * all) / y.squaredNorm();
  const auto [G, b] = model.project(means);
  EXPECT_LT((G - rest.transpose() * rest).cwiseAbs().maxCoeff(), 1e-9 * G.norm());
  EXPECT_LT((b - rest.transpose() * d.r).cwiseAbs().maxCoeff(), 1e-9 * G.norm());
}

TEST(PieceModel, LooksAtAnotherResidual) {
  Drawn d;
  PieceModel model(d.sums, d.dictionary);
  model.choose({model.column(0, d.dictionary.means.col(0).cast<double>())});
  d.r = drawn(rows, 1, 8);
  model.look_at(d.Z.transpose() * d.r, d.r.squaredNorm());
  expect_gains(d, model, Eigen::MatrixXd::Identity(rows, rows));
}

}  // namespace
}  // namespace selfcal::discovery
