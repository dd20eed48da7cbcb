// What the pieces of a recording hold of a law, beside what its own column holds.
#include "estimator/discovery/pieces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/scene.hpp"
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
