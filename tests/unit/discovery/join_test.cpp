// Two recordings in one search, over a few pieces whose answer can be worked out on paper.
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/process.hpp"

namespace selfcal::discovery {
namespace {

constexpr int axis = 4;  // accel_y

// Three pieces of 60 s, the second a turn; each bias is seen by itself with this information, and this score on one axis.
PieceSums recording(double information, const Eigen::Vector3d& score) {
  PieceSums r;
  r.pieces = {{0.0, 60.0, 0, false}, {60.0, 120.0, 1, true}, {120.0, 180.0, 1, false}};
  r.piece_dt = Eigen::VectorXd::Constant(3, 60.0);
  r.piece_of = {0, 1, 2};
  r.nodes = {{30.0, 60.0}, {90.0, 60.0}, {150.0, 60.0}};
  r.channels = laws::Channels::Zero(3, static_cast<Eigen::Index>(laws::variable_count));
  r.sums.information = information * Eigen::MatrixXd::Identity(3 * axis_count, 3 * axis_count);
  r.sums.score = Eigen::VectorXd::Zero(3 * axis_count);
  r.sums.score(Eigen::seqN(axis, 3, axis_count)) = score;
  r.sums.square = 100.0;
  r.sums.rows = 50.0;
  return r;
}

Dictionary no_functions(Eigen::Index pieces) {
  Dictionary d;
  d.means.resize(pieces, 0);
  return d;
}

TEST(Join, ALawHasOneCoefficientInAllRecordings) {
  const PieceSums all = join({recording(2.0, {1.0, 2.0, 3.0}), recording(5.0, {-4.0, 0.0, 8.0})});
  ASSERT_EQ(all.pieces.size(), 6U);
  EXPECT_EQ(all.sums.square, 200.0);
  EXPECT_EQ(all.sums.rows, 100.0);
  EXPECT_EQ(all.pieces[3].recording, 1);
  EXPECT_EQ(all.pieces[3].dwell, 2);  // a dwell of its own
  EXPECT_EQ(all.piece_of[4], 4);
  const Dictionary none = no_functions(6);
  const PieceModel model(all, none);
  Eigen::VectorXd f(6);
  f << 1.0, 0.5, -1.0, 2.0, 1.0, 1.0;
  // (sum of the scores)^2 over the sum of the informations: (1 + 1 - 3 - 8 + 8)^2 / (2 * 2.25 + 5 * 6).
  EXPECT_NEAR(model.gain(axis, f), 1.0 / 34.5, 1e-12);
  EXPECT_EQ(model.gain(axis - 1, f), 0.0);
}

TEST(Join, TheFittedOnesAreProjectedOutOfAllRecordings) {
  const PieceSums all = join({recording(1.0, {3.0, 0.0, 0.0}), recording(1.0, {4.0, 0.0, 0.0})});
  const Dictionary none = no_functions(6);
  PieceModel model(all, none);
  Eigen::VectorXd first = Eigen::VectorXd::Zero(6), both = Eigen::VectorXd::Zero(6);
  first(0) = 1.0;
  both(0) = both(3) = 1.0;
  EXPECT_NEAR(model.gain(axis, both), 49.0 / 2.0, 1e-12);
  model.choose({model.column(axis, both)});
  EXPECT_NEAR(model.square(), 200.0 - 24.5, 1e-7);  // the fit is regularised by 1e-9 of its information
  // What is left of the first by itself: score 3 - 7/2, information 1 - 1/2.
  EXPECT_NEAR(model.gain(axis, first), 0.25 / 0.5, 1e-6);
}

// A walk starts anew in each recording: no increment leads from one to the next.
TEST(Join, AWalkStartsAnewInEachRecording) {
  const PieceSums all = join({recording(1.0, {0.0, 0.0, 0.0}), recording(1.0, {0.0, 0.0, 0.0})});
  const Dictionary none = no_functions(6);
  const PieceModel model(all, none);
  const ProcessFit walk = fit_process(model, all, ProcessKind::random_walk, axis);
  ASSERT_EQ(walk.columns.cols(), 4);
  const double step = std::sqrt(60.0 / 3600.0);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, 4);
  expected.col(0).segment(1, 2).setConstant(step);
  expected.col(1).segment(2, 1).setConstant(step);
  expected.col(2).segment(4, 2).setConstant(step);
  expected.col(3).segment(5, 1).setConstant(step);
  const Eigen::MatrixXd means = walk.columns(Eigen::seqN(axis, 6, axis_count), Eigen::all);
  EXPECT_LT((means - expected).norm(), 1e-12);
  EXPECT_EQ(walk.log_likelihood_gain, 0.0);
}

}  // namespace
}  // namespace selfcal::discovery
