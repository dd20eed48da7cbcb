// What effects of the catalogue can make of laws, by what laws and effects are (handbook, "The catalogue as laws").
#include "estimator/discovery/catalogue_reach.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/discovery/scene.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

const diagnosis::Effect& effect_of(const std::string& id) {
  for (const diagnosis::Effect& e : diagnosis::catalogue()) {
    if (e.id == id) {
      return e;
    }
  }
  ADD_FAILURE() << "no " << id << " in the catalogue";
  return diagnosis::catalogue().front();
}

LawTerm law(int axis, const std::string& expression) {
  LawTerm term;
  term.axis = axis;
  term.expression = *laws::Expression::parse(expression);
  return term;
}

// A creep on the z accelerometer, a cube of the force on x, and on the z gyro a strong wave that no effect has.
class Reach : public testing::Test {
 protected:
  static diagnosis::IdealRecording ideal() {
    return {*named_schedule("horizontal", 60.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 0.2, 0.0}, 50.0};
  }
  static CalibrationResult calibration_of(const diagnosis::IdealRecording& ideal) {
    CalibrationResult calibration;
    calibration.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
    calibration.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
    calibration.noise.observation.sigma = 3e-6;
    calibration.linearised_value.setZero();
    calibration.linearised_C_nb = ideal.C_nb_start();
    return calibration;
  }
  static CatalogueReach of_three() {
    const diagnosis::IdealRecording recording = ideal();
    const CalibrationResult calibration = calibration_of(recording);
    return {{recording.data(), calibration},
            {law(5, "exp(-since/35)"), law(3, "fx**3"), law(2, "sin(2*pi*t/0.04)")},
            Eigen::Vector3d(60.0, 40.0, 5.0)};
  }
};

TEST_F(Reach, AnEffectMakesItsOwnLawAndNoOther) {
  const CatalogueReach reach = of_three();
  EXPECT_GT(reach.share({true, false, false}), 0.98);  // 35 s lies between two constants that are tried
  EXPECT_GT(reach.share({false, true, false}), 0.999);
  EXPECT_LT(reach.share({false, false, true}), 0.3);
  EXPECT_GT(reach.largest_share(effect_of("accel_cubic")), 0.999);
  EXPECT_GT(reach.largest_share(effect_of("accel_relaxation")), 0.98);
  EXPECT_LT(reach.largest_share(effect_of("gyro_drift_ramp")), 0.3);
}

// The wave has by far the most of the square.
TEST_F(Reach, IsThatOfTheSum) {
  const CatalogueReach reach = of_three();
  EXPECT_LT(reach.share({true, false, true}), 0.3);
  EXPECT_EQ(reach.share({false, false, false}), 0.0);
}

// Both are concealed as laws: a gyro that follows a force, which is an effect's, and a creep. A law that is not there stands in the place of the first.
TEST_F(Reach, TheEffectThatExplainsARecordingBesideOneLaw) {
  const diagnosis::IdealRecording recording = ideal();
  const CalibrationResult calibration = calibration_of(recording);
  const std::vector<LawTerm> there = {law(0, "fy"), law(5, "exp(-since/35)")};
  const Eigen::Vector2d size(0.1, 60.0);  // deg/h, ug
  Scene scene({recording.data(), calibration});
  scene.table = collect_nodes(scene.motion, scene.input);
  const diagnosis::CorrectedRecording concealed = without_laws(scene.motion, scene.table, scene.input, there, -size);

  const UnitRecording searched{concealed.data(), calibration};
  const CatalogueReach reach(searched, {there[1], law(0, "exp(-since/200)*fz")}, Eigen::Vector2d(60.0, 10.0));
  const std::vector<CatalogueReach::BesideOneLaw> best = reach.beside_one_law();
  ASSERT_FALSE(best.empty());
  EXPECT_EQ(best.front().effect.effect, &effect_of("gyro_g_sensitivity"));
  EXPECT_GT(best.front().gain, reach.gain_of_laws());
  EXPECT_GT(best.front().more, 0.1 * best.front().gain);
  // All of the recording: the laws that are there make no more of it.
  const CatalogueReach by_truth(searched, there, size);
  EXPECT_NEAR(best.front().gain / by_truth.gain_of_laws(), 1.0, 1e-3);
  // Linear in both but for what errors of 60 ug make of the motion on which laws are evaluated.
  const double typical = best.front().effect.effect->parameters[1].typical;
  EXPECT_NEAR(best.front().effect.size(1) * typical, 0.1, 1e-3);
}

// A name that was taken out makes of the laws found beside it what it would make of them otherwise: it may have bent them. With one of the laws
// it explains no more of the recording, for it is fitted anew beside them in any case.
TEST_F(Reach, ANameThatWasTakenOutMayStandInPlaceOfLaws) {
  const diagnosis::IdealRecording recording = ideal();
  const CalibrationResult calibration = calibration_of(recording);
  const diagnosis::Effect& creep = effect_of("accel_relaxation");
  const std::vector<LawTerm> laws = {law(5, "exp(-since/35)"), law(2, "sin(2*pi*t/0.04)")};
  Scene scene({recording.data(), calibration});
  scene.table = collect_nodes(scene.motion, scene.input);
  const diagnosis::CorrectedRecording concealed =
      without_laws(scene.motion, scene.table, scene.input, laws, -Eigen::Vector2d(60.0, 0.5));

  const std::vector<EffectTerm> named = {{&creep, 35.0, Eigen::Vector3d(0.0, 0.0, 0.0)}};
  const CatalogueReach reach({concealed.data(), calibration, named}, laws, Eigen::Vector2d(60.0, 0.5));
  EXPECT_GT(reach.share({true, false}), 0.98);
  EXPECT_GT(reach.largest_share(creep), 0.98);
  for (const CatalogueReach::BesideOneLaw& b : reach.beside_one_law()) {
    if (b.effect.effect == &creep) {
      EXPECT_LT(b.more, 0.01 * b.gain);
    }
  }
}

}  // namespace
}  // namespace selfcal::discovery
