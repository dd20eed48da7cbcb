// Periods of a wave that are found, and that fit alike, where the pieces are measured one by one, each with the same sigma.
#include "estimator/discovery/shortlist.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "estimator/discovery/dictionary.hpp"

namespace selfcal::discovery {
namespace {

constexpr int pieces = 100;
constexpr double piece_s = 30.0, duration_h = pieces * piece_s / 3600.0, period_h = 0.2;

// A wave over the time times wx on the first axis, its square `gain`; wx is 1 in the pieces that are `seen` and 0 elsewhere.
template <typename F>
PieceSums wave_where(F&& seen, double gain, double period = period_h) {
  PieceSums sums;
  sums.channels = laws::Channels::Zero(pieces, static_cast<Eigen::Index>(laws::variable_count));
  sums.piece_dt = Eigen::VectorXd::Constant(pieces, piece_s);
  sums.sums.information = Eigen::MatrixXd::Identity(pieces * axis_count, pieces * axis_count);
  sums.sums.score = Eigen::VectorXd::Zero(pieces * axis_count);
  for (int k = 0; k < pieces; ++k) {
    const double time_s = piece_s * (k + 0.5);
    sums.channels(k, static_cast<Eigen::Index>(laws::Variable::t)) = time_s / 3600.0;
    sums.channels(k, static_cast<Eigen::Index>(laws::Variable::wx)) = seen(k) ? 1.0 : 0.0;
    sums.nodes.push_back({time_s, piece_s});
    sums.piece_of.push_back(k);
    sums.pieces.push_back({piece_s * k, piece_s * (k + 1), k / 5, false});
    sums.sums.score(k * axis_count) = seen(k) ? std::sin(2.0 * std::numbers::pi * time_s / 3600.0 / period + 0.4) : 0.0;
  }
  sums.sums.score *= std::sqrt(gain) / sums.sums.score.norm();
  sums.sums.square = gain;
  return sums;
}

struct Values {
  std::vector<Candidate> all;
  double own_gain = 0.0;

  // Those that are within odds of 1:100 of the wave.
  int alike() const {
    int count = 0;
    for (const Candidate& c : all) {
      count += 0.5 * (own_gain - c.gain) < std::log(100.0) ? 1 : 0;
    }
    return count;
  }
};

Values values(const PieceSums& sums, const std::string& text, std::vector<double> constants) {
  laws::VariableSet available;
  available.set(static_cast<std::size_t>(laws::Variable::t));
  available.set(static_cast<std::size_t>(laws::Variable::wx));
  const Dictionary dictionary = make_dictionary(sums, available);
  const PieceModel model(sums, dictionary);
  Candidate own;
  own.term = {0, *laws::Expression::parse(text), std::move(constants)};
  own.gain = 900.0;
  return {Shortlist(sums, dictionary).values_of_wave(model, own), own.gain};
}

// At 30 sigma sigma of the frequency is sqrt(6) / (pi T 30) = 0.026 / T, half a step of 0.05 / T. Within odds of 1:100 is what is less than 3.03 sigma
// away: one step to either side.
TEST(ValuesOfAWave, SeenAllTheTimeOnlyItsNeighbours) {
  const Values v = values(wave_where([](int /*k*/) { return true; }, 900.0), "sin(2*pi*t/?+?)*wx", {period_h, 0.4});
  EXPECT_EQ(v.all.size(), 40U);  // up to 2 half periods of resolution, twenty steps, to either side
  EXPECT_EQ(v.alike(), 2);
  for (const Candidate& c : v.all) {
    EXPECT_LE(c.gain, v.own_gain + 1e-6);  // nothing fits better than the truth
    EXPECT_NEAR(1.0 / c.term.constants[0], 1.0 / period_h, 1.01 / duration_h);
  }
}

// Amplitude, phase and period from four pieces that lie together: what is far from the period fits as well.
TEST(ValuesOfAWave, SeenInFourPiecesManyFitAlike) {
  const Values v = values(wave_where([](int k) { return k % 5 == 0 && k >= 40 && k < 60; }, 900.0),
                          "sin(2*pi*t/?+?)*wx", {period_h, 0.4});
  EXPECT_GT(v.alike(), 8);
}

// The grid is half a period of resolution apart: each period lies between two of it, and the refinement reaches it. What is left of a wave
// of 30 sigma is less than one: 0.1 % of its square.
TEST(BestOfAWave, EveryPeriodIsFound) {
  laws::VariableSet available;
  available.set(static_cast<std::size_t>(laws::Variable::t));
  available.set(static_cast<std::size_t>(laws::Variable::wx));
  constexpr double gain = 900.0, step = 1.05;
  for (double period = 0.1 * duration_h; period < 1.9 * duration_h; period *= step) {
    const PieceSums sums = wave_where([](int /*k*/) { return true; }, gain, period);
    const Dictionary dictionary = make_dictionary(sums, available);
    const PieceModel model(sums, dictionary);
    double found = 0.0;
    for (const Candidate& c : Shortlist(sums, dictionary).best(model, 40)) {
      const bool wave = c.term.axis == 0 && c.term.expression.text() == "sin(2*pi*t/?+?)*wx";
      found = std::max(found, wave ? c.gain : 0.0);
    }
    EXPECT_GT(found, gain - 1.0) << "period " << period / duration_h << " of the recording";
  }
}

TEST(ValuesOfAWave, NoneOfWhatIsNoWave) {
  EXPECT_TRUE(values(wave_where([](int /*k*/) { return true; }, 900.0), "exp(-t/?)*wx", {0.3}).all.empty());
}

}  // namespace
}  // namespace selfcal::discovery
