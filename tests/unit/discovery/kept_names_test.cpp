// A creep that the catalogue names and rejects, and what the search tells instead: the same function, or another one.
#include "estimator/discovery/kept_names.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "estimator/diagnosis/effects/catalogue.hpp"
#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/discovery/laws_leave.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::discovery {
namespace {

using diagnosis::Effect;

const Effect& effect_of(const std::string& id) {
  for (const Effect& e : diagnosis::catalogue()) {
    if (e.id == id) {
      return e;
    }
  }
  ADD_FAILURE() << "no " << id << " in the catalogue";
  return diagnosis::catalogue().front();
}

constexpr double tau_s = 35.0;
constexpr double size_ug = 75.0;

// Perfect sensors but for a creep of 75 ug on z, as the passes see it with the noise of good ones.
class KeptNames : public testing::Test {
 protected:
  KeptNames() : ideal_(*named_schedule("horizontal", 60.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 0.2, 0.0}, 50.0) {
    calibration_.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
    calibration_.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
    calibration_.noise.observation.sigma = 3e-6;
    calibration_.linearised_value.setZero();
    calibration_.linearised_C_nb = ideal_.C_nb_start();
    recorded("exp(-since/?)");
    rejected("accel_relaxation", 40.0, Eigen::Vector3d(0.0, 0.0, 1.5));
  }

  // The recording holds this on z.
  void recorded(const std::string& expression) {
    recording_ = less_laws({ideal_.data(), calibration_}, told(expression, -size_ug, {tau_s}).fit);
  }

  // Named with a constant that is not quite right, and rejected.
  void rejected(const std::string& id, double constant, const Eigen::VectorXd& size) {
    diagnosis::Finding finding;
    finding.effect = id;
    finding.source = &effect_of(id);
    diagnosis_.rejected = {finding};
    diagnosis_.rejected_by_remains_alone = true;
    diagnosis_.rejected_model = {{&effect_of(id), constant, size, Eigen::MatrixXd::Identity(size.size(), size.size())}};
    diagnosis_.unexplained = diagnosis_.mismatch = true;
    diagnosis_.verdict = diagnosis::DiagnosisVerdict::none_of_the_above;
  }

  // The search told this of z.
  Discovery told(const std::string& expression, double coefficient, std::vector<double> constants) const {
    Discovery found;
    LawTerm term;
    term.axis = 5;
    term.expression = *laws::Expression::parse(expression);
    term.constants = std::move(constants);
    found.fit.terms = {term};
    found.fit.coefficient = Eigen::VectorXd::Constant(1, coefficient);
    found.laws.resize(1);
    found.laws.front().term = term;
    found.laws.front().coefficient = coefficient;
    found.left.emplace();
    found.functions_tried = 50'000;
    return found;
  }

  bool says(Discovery found) const {
    return say_what_was_rejected({recording_.data(), calibration_}, diagnosis_, found);
  }

  diagnosis::IdealRecording ideal_;
  CalibrationResult calibration_;
  diagnosis::CorrectedRecording recording_;
  diagnosis::Diagnosis diagnosis_;
};

TEST_F(KeptNames, TheSameFunctionSaysWhatWasRejected) { EXPECT_TRUE(says(told("exp(-since/?)", size_ug, {tau_s}))); }

TEST_F(KeptNames, AnotherFunctionSaysSomethingElse) {
  EXPECT_FALSE(says(told("exp(-since/?)*fx", size_ug, {tau_s})));
  rejected("accel_bias_ramp", NAN, Eigen::Vector3d(0.0, 0.0, 1.0));
  EXPECT_FALSE(says(told("exp(-since/?)", size_ug, {tau_s})));
}

// One that differs by a twentieth with the sense of the turns, 0.25 % of its square: the recording shows it.
TEST_F(KeptNames, WhatFitsFarBetterIsAnother) {
  const std::string by_sense = "exp(-since/?)*(1+0.05*si)";
  EXPECT_TRUE(says(told(by_sense, size_ug, {tau_s})));  // which the recording does not hold
  recorded(by_sense);
  EXPECT_FALSE(says(told(by_sense, size_ug, {tau_s})));
}

// Beside a law that no catalogue holds the creep is marked as the catalogue's, and the whole is not what was rejected.
TEST_F(KeptNames, OneOfTwoLawsIsMarked) {
  Discovery found = told("exp(-since/?)", size_ug, {tau_s});
  const Discovery other = told("sin(inner)*fz", 50.0, {});
  found.laws.push_back(other.laws.front());
  found.fit.terms.push_back(other.fit.terms.front());
  found.fit.coefficient = Eigen::Vector2d(size_ug, 50.0);
  EXPECT_FALSE(say_what_was_rejected({recording_.data(), calibration_}, diagnosis_, found));
  EXPECT_EQ(found.laws[0].effect, "accel_relaxation");
  EXPECT_EQ(found.laws[1].effect, "");
}

TEST_F(KeptNames, NothingIsSaidWhereThereIsNoName) {
  const Discovery found = told("exp(-since/?)", size_ug, {tau_s});
  diagnosis_.rejected_by_remains_alone = false;
  EXPECT_FALSE(says(found));
  rejected("accel_relaxation", tau_s, Eigen::Vector3d(0.0, 0.0, 1.5));
  Discovery described = found;
  described.left.reset();  // something is only described
  EXPECT_FALSE(says(described));
  diagnosis_.unexplained = false;
  EXPECT_FALSE(says(found));
}

TEST_F(KeptNames, StandWithWhatTheyLeave) {
  Discovery found = told("exp(-since/?)", size_ug, {tau_s});
  found.misfit_before = 1000.0;
  found.misfit_after = 36.0;
  found.left->adequacy.largest_sigma = 5.0;
  found.left->places.emplace_back();
  keep_rejected_names(diagnosis_, found);
  EXPECT_EQ(diagnosis_.verdict, diagnosis::DiagnosisVerdict::named);
  EXPECT_TRUE(diagnosis_.mismatch && !diagnosis_.unexplained && diagnosis_.rejected.empty());
  ASSERT_EQ(diagnosis_.findings.size(), 1U);
  ASSERT_EQ(diagnosis_.model.size(), 1U);
  ASSERT_TRUE(diagnosis_.remainder);
  EXPECT_DOUBLE_EQ(diagnosis_.remainder->sigma, 6.0);
  EXPECT_DOUBLE_EQ(diagnosis_.remainder->share, 0.036);
  EXPECT_EQ(diagnosis_.remainder->places.size(), 1U);
}

}  // namespace
}  // namespace selfcal::discovery
