// Lack of fit of an axis against biases at positions and in turns, of normal equations whose data are drawn.
#include "estimator/discovery/lack_of_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "estimator/discovery/dictionary.hpp"
#include "estimator/laws/expression.hpp"
#include "tests/unit/discovery/drawn.hpp"

namespace selfcal::discovery {
namespace {

constexpr Eigen::Index dwells = 8, pieces = 2 * dwells - 1, rows = 400, columns = pieces * axis_count;

// Dwells at four positions, each taken twice, the second time one revolution of the inner axis later; a turn before each but the first.
struct Rotation {
  Eigen::MatrixXd Z = drawn(rows, columns, 1);
  Eigen::VectorXd noise = drawn_normal(rows, 7);
  PieceSums sums;
  Dictionary dictionary;

  Rotation() {
    dictionary.means = drawn(pieces, 1, 3).cast<float>();
    dictionary.functions.resize(1);
  }
  // The residual: noise, and what a function over the pieces does on axis 2.
  void conceal(const Eigen::VectorXd& function) {
    sums = sums_of(Z, noise + of_axis(Z, 2) * function);
    sums.channels = laws::Channels::Zero(pieces, static_cast<Eigen::Index>(laws::variable_count));
    for (int p = 0; p < pieces; ++p) {
      const int dwell = (p + 1) / 2;
      sums.pieces[static_cast<std::size_t>(p)] = {60.0 * p, 60.0 * (p + 1), dwell, p % 2 == 1};
      sums.nodes.push_back({60.0 * p, 60.0});
      sums.piece_of.push_back(p);
      const double quarter = 0.5 * std::numbers::pi;
      sums.channels(p, static_cast<Eigen::Index>(laws::Variable::outer)) = (dwell % 2) * quarter;
      sums.channels(p, static_cast<Eigen::Index>(laws::Variable::inner)) = (dwell / 2) * 2.0 * quarter;
    }
  }
  double log_p(int axis) const { return log_p_of_lack(PieceModel(sums, dictionary), sums, axis, 0.0); }
};

TEST(LackOfFit, PositionsAreThoseOfTheGimbalWhateverTheRevolution) {
  Rotation d;
  d.conceal(Eigen::VectorXd::Zero(pieces));
  const Eigen::MatrixXd at = positions(d.sums), with_turns = positions_and_turns(d.sums);
  EXPECT_EQ(at.cols(), 4);
  EXPECT_EQ(at.sum(), static_cast<double>(dwells));
  EXPECT_TRUE(((at.transpose() * at).diagonal().array() == 2.0).all());
  EXPECT_EQ(with_turns.cols(), 4 + dwells - 1);
  EXPECT_TRUE((with_turns.rowwise().sum().array() == 1.0).all());  // each piece in one group
}

// Of 400 draws of the noise alone 1 % are below log 0.01; two questions of one noise are less than two apart, so fewer, 9 at most by chance.
TEST(LackOfFit, NoiseAloneIsRarelyALack) {
  Rotation d;
  int refused = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    d.noise = drawn_normal(rows, 100 + seed);
    d.conceal(Eigen::VectorXd::Zero(pieces));
    refused += d.log_p(2) < std::log(0.01) ? 1 : 0;
  }
  EXPECT_LE(refused, 9);
}

// What one position does, and what one turn does, of 8 sigma: chi squared of 64 and more over 4 or 11 degrees.
TEST(LackOfFit, OnePositionOrOneTurnIsSeen) {
  Rotation d;
  for (const bool turn : {false, true}) {
    Eigen::VectorXd function = Eigen::VectorXd::Zero(pieces);
    if (turn) {
      function(3) = 1.0;
    } else {
      function(2) = function(10) = 1.0;  // dwells 1 and 5
    }
    function *= 8.0 / (of_axis(d.Z, 2) * function).norm();
    d.conceal(function);
    EXPECT_LT(d.log_p(2), std::log(1e-5)) << turn;
  }
}

// Chosen laws take no degree but their own, and what they explain is no lack.
TEST(LackOfFit, WhatALawExplainsIsNoLack) {
  Rotation d;
  d.noise.setZero();
  const Eigen::VectorXd law = 50.0 * d.dictionary.means.col(0).cast<double>();
  d.conceal(law);
  PieceModel model(d.sums, d.dictionary);
  EXPECT_LT(log_p_of_lack(model, d.sums, 2, 0.0), std::log(1e-5));
  model.choose({model.column(2, law)});
  EXPECT_NEAR(log_p_of_lack(model, d.sums, 2, 0.0), 0.0, 1e-6);
}

}  // namespace
}  // namespace selfcal::discovery
