// The gate, the summary and the numbers that are told of a result.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "daemon/estimate/effect_words.hpp"
#include "daemon/estimate/judged_result.hpp"
#include "daemon/estimate/quantity_text.hpp"
#include "daemon/estimate/result_json.hpp"
#include "daemon/estimate/result_table.hpp"

namespace selfcal {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// Everything well inside its tolerance, recording and model in agreement.
CalibrationResult good_result() {
  CalibrationResult result;
  result.value = 0.01 * plausible_limit();
  result.sigma = 0.1 * default_tolerance();
  result.covariance = result.sigma.cwiseAbs2().asDiagonal();
  result.attitude_sigma.setZero();
  result.determined.fill(true);
  result.plausible.fill(true);
  result.consistency.nis_mean = 1.0;
  result.consistency.nis_low = 0.9;
  result.consistency.nis_high = 1.1;
  result.consistency.whiteness_p_value = 0.4;
  return result;
}

CalibrationResult inconsistent_result() {
  CalibrationResult result = good_result();
  result.consistency.verdict = Verdict::inconsistent;
  result.consistency.nis_mean = 8.2;
  result.consistency.whiteness_p_value = 0.0;
  return result;
}

diagnosis::Diagnosis creep() {
  diagnosis::Diagnosis d;
  d.verdict = diagnosis::DiagnosisVerdict::named;
  d.mismatch = true;
  d.calibration = inconsistent_result();
  d.value = d.calibration.value;
  d.sigma = d.calibration.sigma;
  d.value(0) = d.calibration.value(0) - 19.0 * 9.80665e-6;  // 19 ug, which are 19 of its sigmas
  d.before.nis = 8.2;
  d.after.nis = 1.01;
  diagnosis::Finding finding;
  finding.effect = "accel_relaxation";
  finding.significance = 85.0;
  finding.parameters = {{"x", "ug", 49.81, 0.58}, {"tau", "s", 45.1, 1.2}};
  d.findings = {finding};
  return d;
}

nlohmann::json document_of(const JudgedResult& judged) {
  Recording recording;
  recording.sample_rate_hz = 200.0;
  return nlohmann::json::parse(result_json_text(judged, {}, recording, {}));
}

// Limits were known to the run and not to its stored result: refused, and told as accepted.
TEST(Gate, AResultRefusedForALimitAloneIsNotStoredAsAcceptable) {
  Limits limits;
  limits[0] = 10.0;  // ug; the value is 100 ug
  const JudgedResult judged_result = judged(good_result(), default_tolerance(), limits, {"r.h5", 0});
  ASSERT_THAT(judged_result.gate.words(), ElementsAre("accel_bias_x = 100 ug is beyond the limit of 10.0 ug"));
  const nlohmann::json document = document_of(judged_result);
  EXPECT_EQ(document.at("acceptable"), false);
  EXPECT_EQ(document.at("objections").size(), 1U);
  EXPECT_EQ(document.at("summary").at("standing"), "bad");
  EXPECT_EQ(document.at("parameters").at(0).at("usable"), false);
  EXPECT_EQ(document.at("parameters").at(1).at("usable"), true);
  Recording recording;
  recording.sample_rate_hz = 200.0;
  EXPECT_THAT(result_table(judged_result, {}, recording, false), HasSubstr("beyond limit"));
}

TEST(Gate, TheMostImportantObjectionComesFirst) {
  CalibrationResult result = inconsistent_result();
  result.determined[0] = false;
  Limits limits;
  limits[0] = 10.0;
  const Gate gate = judge(result, default_tolerance(), limits);
  ASSERT_EQ(gate.objections.size(), 3U);
  EXPECT_EQ(gate.objections[0].kind, ObjectionKind::inconsistent);
  EXPECT_EQ(gate.objections[1].kind, ObjectionKind::beyond_limit);
  EXPECT_EQ(gate.objections[2].kind, ObjectionKind::undetermined);
}

// 269.12 +- 0.63, "ok", where the truth is 250.
TEST(Gate, NoParameterIsOkWhereRecordingAndModelDisagree) {
  const JudgedResult alone = judged(inconsistent_result(), default_tolerance(), {}, {"r.h5", 0});
  const nlohmann::json document = document_of(alone);
  for (const nlohmann::json& parameter : document.at("parameters")) {
    EXPECT_EQ(parameter.at("usable"), false) << parameter;
  }
  Recording recording;
  recording.sample_rate_hz = 200.0;
  const std::string table = result_table(alone, {}, recording, false);
  EXPECT_THAT(table, Not(HasSubstr(" ok\n")));
  EXPECT_THAT(table, StartsWith("verdict"));
  EXPECT_EQ(alone.summary.next, "selfcal diagnose r.h5");
  // The same table does say ok of a good result.
  const JudgedResult good = judged(good_result(), default_tolerance(), {}, {"r.h5", 0});
  EXPECT_THAT(result_table(good, {}, recording, false), HasSubstr(" ok\n"));
}

TEST(Summary, TheCauseIsNamedWhereTheDiagnosisKnowsIt) {
  const JudgedResult named = judged(inconsistent_result(), default_tolerance(), {}, {"my file.h5", 0}, creep());
  EXPECT_EQ(named.summary.standing, SummaryStanding::bad);
  EXPECT_THAT(named.summary.verdict, HasSubstr("creep of the accelerometers after each turn"));
  // What explains it no worse is no detail.
  diagnosis::Diagnosis either = creep();
  either.findings.front().equivalent = {"accel_turn_heat"};
  EXPECT_THAT(summary_of(either, {"r.h5", 0}).verdict,
              HasSubstr("creep of the accelerometers after each turn, or as well accelerometer bias that follows the "
                        "heat of the gimbal's turns."));
  EXPECT_THAT(named.summary.cause, HasSubstr("x 49.81 +- 0.58 ug, 85 sigma"));
  EXPECT_THAT(named.summary.cause, HasSubstr("accel_bias_x is 81.0 ug, not 100.0"));
  EXPECT_EQ(named.summary.next, "selfcal diagnose 'my file.h5'");
  // The corrected value stands beside the biased one.
  Recording recording;
  recording.sample_rate_hz = 200.0;
  const std::string table = result_table(named, {}, recording, false);
  EXPECT_THAT(table, HasSubstr("corrected"));
  EXPECT_THAT(table, Not(HasSubstr(" ok\n")));
}

TEST(Summary, EveryVerdictOfTheDiagnosisHasASentence) {
  diagnosis::Diagnosis d = creep();
  EXPECT_EQ(summary_of(d, {"r.h5", 0}).standing, SummaryStanding::bad);
  d.verdict = diagnosis::DiagnosisVerdict::adequate;
  EXPECT_EQ(summary_of(d, {"r.h5", 0}).standing, SummaryStanding::good);
  d.verdict = diagnosis::DiagnosisVerdict::none_of_the_above;
  d.unexplained = true;
  d.rejected = d.findings;
  EXPECT_THAT(summary_of(d, {"r.h5", 0}).cause, HasSubstr("accel_relaxation (x 49.81 +- 0.58 ug, 85 sigma)"));
  EXPECT_THAT(summary_of(d, {"r.h5", 0}).next, HasSubstr("selfcal diagnose r.h5 --split-schedule"));
  d.verdict = diagnosis::DiagnosisVerdict::not_enough_information;
  EXPECT_EQ(summary_of(d, {"r.h5", 0}).standing, SummaryStanding::open);
  d.verdict = diagnosis::DiagnosisVerdict::data_fault;
  d.faults = {{"lost_samples", "3 gaps", 17, 3}};
  EXPECT_THAT(summary_of(d, {"r.h5", 0}).cause, HasSubstr("3 gaps"));
}

diagnosis::Diagnosis rejected_creep() {
  diagnosis::Diagnosis d = creep();
  d.verdict = diagnosis::DiagnosisVerdict::none_of_the_above;
  d.unexplained = true;
  d.rejected = d.findings;
  d.findings.clear();
  return d;
}

// Accelerometers y and z with a new offset at each turn: what discovery finds stands where "nothing explains it" stood.
TEST(Summary, WhatIsFoundBeyondTheCatalogueIsSaid) {
  const diagnosis::Diagnosis d = rejected_creep();
  discovery::Discovery found;
  found.rows = 5000.0;
  found.misfit_before = 24000.0;  // NIS 5.8
  found.misfit_after = -50.0;     // NIS 0.99
  EXPECT_THAT(summary_of(d, {"r.h5", 0}, &found).verdict, HasSubstr("nothing in the catalogue explains it"));
  found.processes = {{discovery::ProcessKind::jump_per_turn, 4, 24.5, 4.2, 900.0},
                     {discovery::ProcessKind::jump_per_turn, 5, 18.2, 3.1, 600.0}};
  const Summary s = summary_of(d, {"r.h5", 0}, &found);
  EXPECT_EQ(s.standing, SummaryStanding::bad);
  EXPECT_THAT(s.verdict, HasSubstr("accel_y and accel_z take a new offset at each turn"));
  EXPECT_THAT(s.cause, HasSubstr("accel_y: jump per turn, 24.5 +- 4.2 ug; accel_z: jump per turn, 18.2 +- 3.1 ug"));
  EXPECT_THAT(s.cause, HasSubstr("NIS 5.8 becomes 0.99"));
  EXPECT_EQ(s.next, "selfcal diagnose r.h5 --amended amended");
  // The same in what `estimate`, a run and an amendment say.
  const JudgedResult all = judged(inconsistent_result(), default_tolerance(), {}, {"r.h5", 0}, d, found);
  EXPECT_THAT(all.summary.verdict, HasSubstr("accel_y and accel_z take a new offset at each turn"));
  const Gate gate = judge_amended(inconsistent_result(), default_tolerance(), {}, d, 7, &found);
  EXPECT_THAT(gate.objections.front().words, HasSubstr("accel_y and accel_z take a new offset at each turn"));
  // What takes away a part is no explanation, but it is said.
  found.misfit_after = 12000.0;
  const Summary part = summary_of(d, {"r.h5", 0}, &found);
  EXPECT_THAT(part.verdict, HasSubstr("nothing in the catalogue explains it"));
  EXPECT_THAT(part.cause, HasSubstr("50 % of the misfit"));
}

// An equation that makes nearly all of the misfit is the answer, and what it leaves is said with it. One that makes most of it beside an
// axis that follows none is no explanation; the verdict says both.
TEST(Summary, AnEquationBesideWhatIsOnlyDescribedIsSaid) {
  const diagnosis::Diagnosis d = rejected_creep();
  discovery::Discovery found;
  found.rows = 5000.0;
  found.misfit_before = 1000.0;
  discovery::DiscoveredLaw law;
  law.term.axis = 0;
  law.expression = "fz*wo";
  law.carries_over = 1.0;
  law.gain = 930.0;
  found.laws = {law};
  law.term.axis = 4;
  law.expression = "exp(-since/70)*fx";
  law.gain = 60.0;
  found.described = {law};
  const Summary nearly_all = summary_of(d, {"r.h5", 0}, &found);
  EXPECT_EQ(nearly_all.standing, SummaryStanding::bad);
  EXPECT_EQ(nearly_all.verdict,
            "The model leaves out what no catalogue holds: gyro_x follows fz*wo; 7 % of the misfit is left.");
  EXPECT_THAT(nearly_all.cause, HasSubstr("NIS 1.2 becomes 1.01; accel_y follows no equation that was tried"));
  EXPECT_EQ(nearly_all.next, "selfcal diagnose r.h5 --amended amended");
  EXPECT_FALSE(confirmed(&found));  // nothing is written on it
  found.laws.front().gain = 830.0;
  const Summary s = summary_of(d, {"r.h5", 0}, &found);
  EXPECT_EQ(s.standing, SummaryStanding::bad);
  EXPECT_EQ(s.verdict,
            "Recording and model differ: 83 % of the misfit is that gyro_x follows fz*wo; nothing that was tried "
            "explains the rest.");
  EXPECT_THAT(s.cause, HasSubstr("accel_y follows no equation that was tried, exp(-since/70)*fx comes nearest"));
  found.laws.front().gain = 400.0;
  EXPECT_THAT(summary_of(d, {"r.h5", 0}, &found).verdict, HasSubstr("nothing in the catalogue explains it"));
}

TEST(Summary, IsBrokenToTheTerminalAndItsNextStepIsNeverCut) {
  const Summary summary{SummaryStanding::bad, "one two three four five six seven eight nine ten eleven twelve",
                        "why so", "selfcal diagnose /a/long/path/to/a/recording.h5 --split-schedule"};
  const std::string text = summary_text(summary, false, 40, 1);
  EXPECT_THAT(text, StartsWith("verdict  one two three four five six ...\ncause    why so\n"));
  EXPECT_THAT(text, HasSubstr("--split-schedule"));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 40U) << text;
  }
}

// Two digits of sigma, the value to the same place, at any scale.
TEST(QuantityText, HasTheDigitsThatSigmaCarries) {
  EXPECT_EQ(with_sigma(269.1234, 0.634, "ug"), "269.12 +- 0.63 ug");
  EXPECT_EQ(with_sigma(-0.0023456, 0.00101, "deg/h"), "-0.0023 +- 0.0010 deg/h");
  EXPECT_EQ(with_sigma(-380512.0, 2104.0, "ug"), "-380512 +- 2104 ug");
  EXPECT_EQ(with_sigma(2.6134e-7, 1.22e-9, "s"), "2.613e-07 +- 1.2e-09 s");
  EXPECT_EQ(with_sigma(1e300, 1e299, "m"), "1.00e+300 +- 1.0e+299 m");
  EXPECT_EQ(with_sigma(3.0, 0.0999, ""), "3.00 +- 0.10");
  EXPECT_EQ(with_sigma(3.14159, 0.0, "s"), "3.142 +- ? s");
}

// A test that was not made has no p-value: "white (p = 1)" stood there.
TEST(Summary, ColourOfTheSensorsIsNotCalledWhite) {
  diagnosis::Adequacy adequacy;
  adequacy.log_p_white = -900.0;
  EXPECT_EQ(innovations_text(adequacy), "correlated in time (p below 1e-12)");
  adequacy.coloured = true;
  EXPECT_EQ(innovations_text(adequacy), "coloured by quantum and lines");
}

TEST(QuantityText, SaysPValuesAsPeopleDo) {
  EXPECT_EQ(whiteness_text(-9166.6), "correlated in time (p below 1e-12)");
  EXPECT_EQ(whiteness_text(std::log(0.32)), "white (p = 0.32)");
}

TEST(EffectWords, DefineEachSymbolOnce) {
  const std::vector<Symbol> symbols = symbols_of("dw_i = sum_j G_ij u_j");
  ASSERT_EQ(symbols.size(), 3U);
  EXPECT_EQ(symbols[2].name, "u_j");
  EXPECT_EQ(symbols_of("d = a sin(2 pi f t)")[2].meaning, "frequency, fitted");
}

// A parked vehicle has a hundred vibration lines: they are one kind. And what is named may leave something.
TEST(Summary, NamesEachKindOnceAndWhatIsLeft) {
  diagnosis::Diagnosis d = creep();
  diagnosis::Finding line = d.findings.front(), quantum = line;
  line.effect = "vibration_line";
  quantum.effect = "quantisation";
  d.findings = {line, line, quantum, line, quantum, d.findings.front()};
  const Subject subject{"real.csv", 0};
  const std::string whole = summary_of(d, subject, nullptr).verdict;
  EXPECT_THAT(whole, HasSubstr("3 of them; and "));
  EXPECT_THAT(whole, HasSubstr("; and 1 more."));
  d.unexplained = true;
  d.remaining.emplace_back();
  d.remaining.back().significance = 6.4;
  d.remaining.back().words = "accelerometer z, minutes 10 to 12";
  const Summary left = summary_of(d, subject, nullptr);
  EXPECT_THAT(left.verdict, HasSubstr("; and 1 more; and what none of these explains."));
  EXPECT_THAT(left.cause, HasSubstr("6.4 sigma remain in accelerometer z, minutes 10 to 12."));
}

}  // namespace
}  // namespace selfcal
