// The verdict on search results made by hand: each limit from both sides, with the figures that the budget gives.
#include "estimator/diagnosis/search/judgement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/diagnosis/linear.hpp"

namespace selfcal::diagnosis {
namespace {

const Effect a = one_coefficient("a");
constexpr double alpha = 0.005;

Rules rules_of_one(bool goes_on = true) {
  return {.budget = budget_of_one, .alpha = alpha, .goes_on = [goes_on](const BiasProcess&) { return goes_on; }};
}

// 3000 rows of unit noise, a map of 100 places.
SearchResult clean() {
  SearchResult r;
  r.rows = 3000.0;
  for (Shown* s : {&r.before, &r.after}) {
    s->square = r.rows;
    s->map.tests = 100;
    s->map.largest_sigma = 2.0;
  }
  return r;
}

// One effect is named and takes a square of 10 000 away.
SearchResult one_named() {
  SearchResult r = clean();
  r.before.square += 1e4;
  NamedTerm term;
  term.effect = &a;
  term.amplitude = Eigen::VectorXd::Ones(1);
  term.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-4);
  term.delta_chi2 = 1e4;
  term.log_p = -5000.0;
  r.misfit = 1e4;
  r.named = {term};
  return r;
}

SearchResult with_walk() {
  SearchResult r = clean();
  BiasProcess process;
  process.axes = {3};
  process.delta_chi2 = 100.0;
  r.processes = {process};
  return r;
}

bool accepted(const SearchResult& r, const Rules& rules = rules_of_one()) { return judge(r, rules).after.accepted; }

TEST(Verdict, OfACleanRecordingIsAdequate) {
  const Judgement j = judge(clean(), rules_of_one());
  EXPECT_TRUE(j.before.accepted && j.after.accepted && j.named.empty());
  EXPECT_EQ(verdict_of(false, false, false), DiagnosisVerdict::adequate);
  EXPECT_EQ(verdict_of(false, false, true), DiagnosisVerdict::not_enough_information);
  EXPECT_EQ(verdict_of(false, true, true), DiagnosisVerdict::none_of_the_above);
  EXPECT_EQ(verdict_of(true, true, true), DiagnosisVerdict::named);
}

// A tenth of 0.5 % over 100 places is 5e-6 for one: 4.565 sigma, two-sided.
TEST(Verdict, HoldsTheMapToItsShareOfTheBudget) {
  SearchResult r = clean();
  r.after.map.largest_sigma = 4.55;
  EXPECT_TRUE(accepted(r));
  r.after.map.largest_sigma = 4.58;
  EXPECT_FALSE(accepted(r));
}

// Where a name makes as much as it leaves 1 % counts, of which the map has a tenth: 1e-5 for one place, 4.417 sigma; elsewhere
// it is 4.565 as without a name.
TEST(Verdict, HoldsNamesToMoreWhereTheyMakeWhatIsSeen) {
  SearchResult r = one_named();
  r.before.square += 1e6;  // so that what is left is not below what is worth a verdict
  r.after.square += 2000.0;
  r.rows = 1e6;  // NIS 1.002: within the 4 % that the densities are known to
  r.before.square += 1e6 - 3000.0;
  r.after.square += 1e6 - 3000.0;
  r.after.map.largest_sigma = 4.55;
  r.after.map.largest_named_sigma = 4.40;
  EXPECT_TRUE(accepted(r));
  r.after.map.largest_named_sigma = 4.43;
  EXPECT_FALSE(accepted(r));
  r.after.map.largest_named_sigma = 4.40;
  r.after.map.largest_sigma = 4.58;
  EXPECT_FALSE(accepted(r));
}

// Many together: 1 % where the names are, a tenth of 0.5 % elsewhere.
TEST(Verdict, HoldsStructureToOnePerCentWhereTheNamesAre) {
  SearchResult r = clean();
  r.structure.log_p_named = std::log(0.011);
  EXPECT_TRUE(accepted(r));
  r.structure.log_p_named = std::log(0.009);
  EXPECT_FALSE(accepted(r));
  r.structure = {0.0, std::log(5.1e-4)};
  EXPECT_TRUE(accepted(r));
  r.structure = {0.0, std::log(4.9e-4)};
  EXPECT_FALSE(accepted(r));
  Rules moored = rules_of_one();
  moored.motion_fitted = true;
  EXPECT_TRUE(accepted(r, moored)) << "a base that moves has structure of its own";
}

// A tenth of 0.5 %, and of beats that are named as a quantum none.
TEST(Verdict, HoldsWhitenessToItsShareOfTheBudget) {
  SearchResult r = clean();
  r.after.log_p_white = std::log(5.1e-4);
  EXPECT_TRUE(accepted(r));
  r.after.log_p_white = std::log(4.9e-4);
  EXPECT_FALSE(accepted(r));
  Rules coloured = rules_of_one();
  coloured.coloured = true;
  EXPECT_TRUE(accepted(r, coloured));
}

// sigma of the NIS is sqrt(2/3000 + 0.04^2) = 0.0476; 5e-4 two-sided is 3.48 of it.
TEST(Verdict, HoldsTheSizeOfTheInnovationsToItsShareOfTheBudget) {
  SearchResult r = clean();
  r.after.square = r.rows * (1.0 + 3.46 * 0.0476);
  EXPECT_TRUE(accepted(r));
  r.after.square = r.rows * (1.0 + 3.50 * 0.0476);
  EXPECT_FALSE(accepted(r));
}

// Names alone do not make an explanation.
TEST(Verdict, RefusesNamesThatAreACurveOrLeaveTheirLikeness) {
  SearchResult r = one_named();
  EXPECT_TRUE(accepted(r));
  r.collinear = true;
  EXPECT_FALSE(accepted(r));
  EXPECT_FALSE(judge(r, rules_of_one()).names_stand);
  r = one_named();
  r.log_p_lack_of_fit = std::log(0.009);
  EXPECT_FALSE(accepted(r));
}

TEST(Verdict, RefusesAWalkThatJumps) {
  const Judgement processes = judge(with_walk(), rules_of_one());
  EXPECT_TRUE(processes.after.accepted);
  EXPECT_EQ(processes.named.size(), 1U);
  const Judgement jumps = judge(with_walk(), rules_of_one(false));
  EXPECT_FALSE(jumps.after.accepted);
  EXPECT_EQ(jumps.jumps.size(), 1U);
  EXPECT_TRUE(jumps.named.empty());
}

// A thousandth of 10 000 is 10, in all and (but for 4 sigma anywhere) in one place.
TEST(Verdict, LeavesAThousandthOfAStrongEffectAlone) {
  SearchResult r = one_named();
  r.structure.log_p_named = -100.0;
  r.after.square = r.rows + 9.9;
  EXPECT_TRUE(accepted(r));
  r.after.map.largest_sigma = 4.1;
  EXPECT_FALSE(accepted(r));
  r.after.map.largest_sigma = 2.0;
  r.after.square = r.rows + 10.1;
  EXPECT_FALSE(accepted(r));
}

// Of the difference of two recordings names stand that make nine tenths of it; of one recording none that leave something.
TEST(Verdict, LetsNamesStandBesideATolerableRemainder) {
  SearchResult r = one_named();
  r.structure.log_p_named = -100.0;
  Rules two = rules_of_one();
  two.budget = budget_of_two;
  two.tolerable_share = 0.1;
  r.after.square = r.rows + 999.0;
  Judgement j = judge(r, two);
  EXPECT_TRUE(!j.after.accepted && j.names_stand);
  EXPECT_FALSE(judge(r, rules_of_one()).names_stand);
  Diagnosis d;
  write_down(r, j, d);
  EXPECT_TRUE(d.unexplained && d.rejected.empty());
  ASSERT_EQ(d.findings.size(), 1U);
  ASSERT_EQ(d.model.size(), 1U);
  EXPECT_EQ(d.model[0].effect, &a);
  r.after.square = r.rows + 1001.0;
  j = judge(r, two);
  EXPECT_FALSE(j.names_stand);
  Diagnosis refused;
  write_down(r, j, refused);
  EXPECT_TRUE(refused.findings.empty() && refused.model.empty());
  EXPECT_EQ(refused.rejected.size(), 1U);
}

}  // namespace
}  // namespace selfcal::diagnosis
