// What an amendment makes of a diagnosis: whose 24, what it may be written for, and what it says.
#include "daemon/estimate/amendment_job.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace selfcal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// The 24 alone say 2, with the effect fitted they say 1; everything well inside its tolerance.
class AmendmentJobTest : public testing::Test {
 protected:
  AmendmentJobTest() {
    const ParameterVector sigma = 0.1 * default_tolerance();
    diagnosis_.calibration.value = 2.0 * sigma;
    diagnosis_.calibration.sigma = 0.5 * sigma;
    diagnosis_.calibration.covariance = ParameterMatrix::Identity();
    diagnosis_.calibration.consistency.verdict = Verdict::inconsistent;
    diagnosis_.calibration.initial_attitude = {};
    diagnosis_.calibration.attitude_sigma.setZero();
    diagnosis_.value = sigma;
    diagnosis_.sigma = sigma;
    diagnosis_.covariance = sigma.cwiseAbs2().asDiagonal();
    diagnosis_.verdict = diagnosis::DiagnosisVerdict::named;
    diagnosis_.mismatch = true;
    diagnosis_.before.nis = 8.0;
    diagnosis_.after.nis = 1.01;
    diagnosis_.after.accepted = true;
    diagnosis::Finding finding;
    finding.effect = "accel_relaxation";
    finding.significance = 120.0;
    finding.parameters = {{"x", "ug", 150.0, 1.0}};
    diagnosis_.findings = {finding};
    diagnosis_.model = {diagnosis::ModelEffect{}};
    recording_.sample_rate_hz = 200.0;
  }
  Estimate estimate() { return amended_estimate(diagnosis_, {{7, "seven.h5"}, {}, "folder", {}}, recording_); }

  // Nothing in the catalogue explains the recording, and a law of `recordings` of them leaves this many squares beyond noise.
  Estimate estimate_with_law(std::size_t recordings, double misfit_after) {
    diagnosis_.unexplained = true;
    diagnosis_.after.accepted = false;
    BeyondAnswer beyond;
    discovery::DiscoveredLaw law;
    law.term = {5, *laws::Expression::parse("fx*sin(outer)"), {}};
    law.expression = "fx*sin(outer)";
    law.coefficient = 30.0;
    law.sigma = 1.0;
    beyond.found.laws = {law};
    beyond.found.rows = 10000.0;
    beyond.found.misfit_before = 20000.0;
    beyond.found.misfit_after = misfit_after;
    beyond.found.fit.recordings.resize(recordings);
    for (discovery::FittedRecording& r : beyond.found.fit.recordings) {
      r.parameters = diagnosis_.value;
      r.covariance = diagnosis_.covariance;
    }
    beyond.found.average.parameters.assign(recordings, 3.0 * diagnosis_.value);
    beyond.found.average.covariance.assign(recordings, 4.0 * diagnosis_.covariance);
    return amended_estimate(diagnosis_, {{7, "seven.h5"}, {{3, "three.h5"}}, "folder", {}}, recording_, beyond);
  }

  diagnosis::Diagnosis diagnosis_;
  Recording recording_;
};

// Its 24 are the mean over all laws that are left, with the spread between them.
TEST_F(AmendmentJobTest, ALawThatTwoRecordingsHoldIsFittedToo) {
  const Estimate answer = estimate_with_law(2, 100.0);
  EXPECT_THAT(answer.objections, IsEmpty());
  EXPECT_EQ(answer.result.consistency.verdict, Verdict::consistent);
  EXPECT_TRUE(answer.result.value.isApprox(3.0 * diagnosis_.value));
  EXPECT_TRUE(answer.result.sigma.isApprox(2.0 * diagnosis_.sigma));
  EXPECT_THAT(answer.notes, testing::Contains(HasSubstr("fx*sin(outer)")));
}

TEST_F(AmendmentJobTest, ALawOfOneRecordingAloneIsNotWritten) {
  EXPECT_THAT(estimate_with_law(1, 100.0).objections,
              testing::Contains(HasSubstr("run 7 holds what no catalogue does")));
}

// sqrt(2 * 10000) = 141 is what the square of noise scatters by.
TEST_F(AmendmentJobTest, ALawThatLeavesMoreThanNoiseIsNotWritten) {
  const Estimate answer = estimate_with_law(2, 1500.0);
  EXPECT_THAT(answer.objections, testing::Contains(HasSubstr("run 7 holds what no catalogue does")));
  EXPECT_EQ(nlohmann::json::parse(answer.result_json).at("acceptable"), false);
}

TEST_F(AmendmentJobTest, TheJointFitIsTheAnswer) {
  const Estimate answer = estimate();
  EXPECT_EQ(answer.result.value, diagnosis_.value);
  EXPECT_EQ(answer.result.sigma, diagnosis_.sigma);
  EXPECT_EQ(answer.result.consistency.verdict, Verdict::consistent);
  EXPECT_THAT(answer.objections, IsEmpty());
  EXPECT_THAT(answer.notes, ElementsAre("accel_relaxation, 120 sigma: x 150.0 +- 1.0 ug"));
  const auto document = nlohmann::json::parse(answer.result_json);
  EXPECT_EQ(document.at("amends"), 7);
  EXPECT_EQ(document.at("diagnosis").at("findings").at(0).at("effect"), "accel_relaxation");
  EXPECT_EQ(document.at("acceptable"), true);
}

TEST_F(AmendmentJobTest, WhatIsNotExplainedIsAnObjection) {
  diagnosis_.after.accepted = false;
  diagnosis_.unexplained = true;
  diagnosis::Located located;
  located.words = "z accelerometer, first 60 s after each turn";
  diagnosis_.remaining = {located};
  const Estimate answer = estimate();
  ASSERT_FALSE(answer.objections.empty());
  EXPECT_THAT(answer.objections[0], HasSubstr("explains run 7: z accelerometer, first 60 s after each turn"));
  EXPECT_EQ(answer.result.consistency.verdict, Verdict::inconsistent);
  EXPECT_EQ(nlohmann::json::parse(answer.result_json).at("acceptable"), false);
}

TEST_F(AmendmentJobTest, ARunInWhichNothingWasNamedIsNotAmended) {
  diagnosis_.findings.clear();
  diagnosis_.model.clear();
  EXPECT_THAT(estimate().objections, ElementsAre(HasSubstr("nothing to amend: no equation was named in run 7")));
}

// The fit of the effect may leave a parameter open that the 24 alone had fixed.
TEST_F(AmendmentJobTest, AParameterThatTheEffectLeavesOpenIsNotDetermined) {
  diagnosis_.sigma(parameter::gyro_scale) = 2.0 * default_tolerance()(parameter::gyro_scale);
  const Estimate answer = estimate();
  EXPECT_FALSE(answer.result.determined[static_cast<std::size_t>(parameter::gyro_scale)]);
  EXPECT_THAT(answer.objections, ElementsAre(HasSubstr("gyro_scale_x not determined")));
}

TEST_F(AmendmentJobTest, AValueBeyondThePossibleIsAnObjection) {
  diagnosis_.value(0) = 2.0 * plausible_limit()(0);
  EXPECT_THAT(estimate().objections, ElementsAre(HasSubstr("accel_bias_x")));
}

}  // namespace
}  // namespace selfcal
