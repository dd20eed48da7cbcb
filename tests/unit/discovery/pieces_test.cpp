// What the pieces of a recording hold of a law, beside what its own column holds.
#include "estimator/discovery/pieces.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/scene.hpp"
#include "estimator/discovery/search_state.hpp"
#include "estimator/discovery/shortlist.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

struct Unit {
  diagnosis::IdealRecording ideal{
      *named_schedule("horizontal", 60.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 0.2, 0.0}, 50.0, 0.27};
  CalibrationResult calibration;

  Unit() {
    calibration.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
    calibration.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
    calibration.noise.observation.sigma = 3e-6;
    calibration.linearised_value.setZero();
    calibration.linearised_C_nb = ideal.C_nb_start();
  }
};

struct Law {
  int axis;
  const char* expression;
};

// A recording of nothing but the law: the share of its square that the best function over the pieces gains, and that function.
std::pair<double, std::string> best_found(const Scene& scene, const Dictionary& dictionary, const Law& law) {
  LawTerm term;
  term.axis = law.axis;
  term.expression = *laws::Expression::parse(law.expression);
  const NodeTable table = collect_nodes(scene.motion, scene.input);
  LawColumns column(scene.motion, table, {term}, false);
  BesidePieces its;
  PieceSums sums = sum_over_pieces(scene.motion, scene.input, scene.trace, column, its);
  constexpr double sigmas = 30.0;
  const double size = sigmas / std::sqrt(its.information(0, 0));
  sums.sums.score = size * its.with_pieces.col(0);
  sums.sums.square = sigmas * sigmas;
  const Candidate best = Shortlist(sums, dictionary).best(PieceModel(sums, dictionary), 12).front();
  return {best.gain / sums.sums.square, best.text()};
}

// The first two are a scale factor but for a small part, of which the means over the pieces alone gain a thirtieth.
TEST(Pieces, FindWhatALawDoes) {
  const Unit unit;
  const Scene scene({unit.ideal.data(), unit.calibration});
  const Dictionary dictionary =
      make_dictionary(sum_over_pieces(scene.motion, scene.input, scene.trace), scene.motion.available());
  for (const Law& law : {Law{2, "wo*cos(inner)**2"}, {1, "wy*abs(si)"}, {0, "wx*abs(wx)"}, {3, "exp(-since/26)*so"}}) {
    const auto [share, words] = best_found(scene, dictionary, law);
    EXPECT_GT(share, 0.93) << law.expression << ": " << words;
    EXPECT_LT(share, 1.03) << law.expression << ": " << words;
  }
}

// Beside an effect a law is what it is beside as many columns more: solved together, and with the effect projected out.
TEST(Pieces, AnEffectBesideALawIsProjectedOutOfEverything) {
  const Unit unit;
  const Scene scene({unit.ideal.data(), unit.calibration});
  const auto& all = diagnosis::catalogue();
  const auto effect =
      std::find_if(all.begin(), all.end(), [](const diagnosis::Effect& e) { return e.id == "gyro_g_sensitivity"; });
  ASSERT_NE(effect, all.end());
  const std::vector<EffectTerm> beside = {{&*effect, NAN, Eigen::VectorXd::Zero(9)}};
  LawTerm term;
  term.expression = *laws::Expression::parse("fy*abs(cos(outer))");  // mostly a g-sensitivity
  const NodeTable table = collect_nodes(scene.motion, scene.input);
  LawColumns law(scene.motion, table, {term}, false);
  LawColumns again(scene.motion, table, {term}, false);
  EffectColumns columns(scene.context, beside);
  TwoSources both(law, columns);
  const ColumnSums together = run_columns(scene.input, scene.trace, both);
  RowSink rows;
  const ColumnSums alone = run_beside(beside, scene.context, scene.input, scene.trace, again, {}, &rows);

  ASSERT_EQ(alone.score.size(), 1);
  const Eigen::MatrixXd covariance = together.information.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::VectorXd value = covariance * together.score;
  EXPECT_LT(alone.information(0, 0), 0.5 * together.information(0, 0));
  EXPECT_NEAR(alone.information(0, 0) * covariance(0, 0), 1.0, 1e-5);
  EXPECT_NEAR(alone.score(0) / alone.information(0, 0), value(0), 1e-5 * std::sqrt(covariance(0, 0)));
  EXPECT_NEAR(rows.columns.squaredNorm() / alone.information(0, 0), 1.0, 1e-5);
  EXPECT_NEAR(rows.columns.col(0).dot(rows.residual), alone.score(0), 1e-5 * std::sqrt(alone.information(0, 0)));
  EXPECT_NEAR(rows.residual.squaredNorm(), alone.square, 1e-6 * (1.0 + alone.square));

  // The 24 follow both, and their sigma holds the effect's.
  const int first = alone.pass.layout.parameters();
  const ParameterVector by_both = together.pass.mean.segment<sensor_parameter_count>(first) + together.shift * value;
  const ParameterVector by_law = alone.pass.mean.segment<sensor_parameter_count>(first) + alone.shift * value.head(1);
  const ParameterMatrix of_both =
      together.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(first, first) +
      together.shift * covariance * together.shift.transpose();
  const ParameterMatrix of_law =
      alone.pass.covariance.block<sensor_parameter_count, sensor_parameter_count>(first, first) +
      alone.shift * alone.shift.transpose() / alone.information(0, 0);
  for (Eigen::Index k = 0; k < sensor_parameter_count; ++k) {
    EXPECT_NEAR(by_law(k), by_both(k), 1e-4 * std::sqrt(of_both(k, k))) << k;
    EXPECT_NEAR(of_law(k, k) / of_both(k, k), 1.0, 1e-4) << k;
  }
}

// From a piece's edge Gauss-Newton came two seconds nearer, and its derivative was nothing where no second begins.
TEST(LawFit, AStepIsPlacedToASecondWhereverTheSearchBegan) {
  const Unit unit;
  const Scene without({unit.ideal.data(), unit.calibration});
  LawTerm step{4, *laws::Expression::parse("sign(t-?)"), {403.3 / units::hour}, 0.01, 0.3};
  const NodeTable table = collect_nodes(without.motion, without.input);
  const diagnosis::CorrectedRecording with =
      without_laws(without.motion, table, without.input, {step}, Eigen::VectorXd::Constant(1, -8.0));
  Scene scene({with.data(), unit.calibration});
  scene.table = collect_nodes(scene.motion, scene.input);
  const std::vector<LawRecording> recordings = {{scene.motion, scene.table, scene.input, scene.trace}};
  for (const double from_s : {387.6, 412.4, 330.0}) {
    step.constants = {from_s / units::hour};
    const LawFit fit = fit_laws(recordings, {step}, constant_rounds);
    EXPECT_NEAR(fit.terms.front().constants.front() * units::hour, 403.3, 1.0) << from_s;
    EXPECT_NEAR(fit.coefficient(0), 8.0, 0.2) << from_s;
    EXPECT_TRUE(fit.recordings.front().covariance.allFinite()) << from_s;
    EXPECT_GT(fit.covariance(1, 1), 0.0) << from_s;
  }
}

// Two recordings have 24 of their own each: twice as many columns, each in one of them only, with information I.
TEST(Pieces, KnownColumnsAreThoseOfEachRecording) {
  const Unit unit;
  const Scene scene({unit.ideal.data(), unit.calibration});
  const PieceSums one = sum_over_pieces(scene.motion, scene.input, scene.trace);
  const Eigen::MatrixXd columns = known_columns(one);
  const PieceSums two = join({one, one});
  const Eigen::MatrixXd X = known_columns(two);
  const Eigen::Index count = X.cols();
  EXPECT_GE(columns.cols(), 18);
  ASSERT_EQ(count, 2 * columns.cols());
  const Eigen::MatrixXd information = X.transpose() * (two.sums.information * X);
  EXPECT_LT((information - Eigen::MatrixXd::Identity(count, count)).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace selfcal::discovery
