#include "estimator/discovery/known_form.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "estimator/discovery/step_with_turns.hpp"

using namespace selfcal::discovery;

namespace {

constexpr double departure_rate = 0.01;

// A law of this axis; its class is the axis alone.
DiscoveredLaw law(int axis, double gain, double carries_over = 0.9) {
  DiscoveredLaw l;
  l.term.axis = axis;
  l.gain = gain;
  l.carries_over = carries_over;
  l.ambiguous = {{"fx", axis, 1.0, {}}};
  return l;
}

void follow(DiscoveredLaw& l, std::string_view expression) {
  l.term.expression = *selfcal::laws::Expression::parse(expression);
}

// Each law follows a quantity of its own.
std::pair<std::size_t, std::size_t> told_and_described(std::vector<DiscoveredLaw> laws,
                                                       std::vector<DiscoveredProcess> processes = {}) {
  constexpr std::array quantities = {"fx", "t", "abs(si)"};
  for (std::size_t k = 0; k < laws.size(); ++k) {
    follow(laws[k], quantities.at(k));
  }
  const TellingLaws t = tell_laws(std::move(laws), processes, departure_rate);
  return {t.told.size(), t.described.size()};
}
using Counts = std::pair<std::size_t, std::size_t>;

TEST(KnownForm, LawsOfTwoAxesAreToldWhateverTheirSizes) {
  EXPECT_EQ(told_and_described({law(0, 900.0), law(4, 30.0)}), Counts(2, 0));
}

TEST(KnownForm, TwoOfOneAxisAreToldWhereAlikeInSizeAndLikelyElsewhere) {
  EXPECT_EQ(told_and_described({law(3, 900.0), law(3, 500.0)}), Counts(2, 0));
  EXPECT_EQ(told_and_described({law(3, 900.0), law(3, 400.0)}), Counts(0, 2));
  EXPECT_EQ(told_and_described({law(3, 900.0), law(3, 500.0, 0.33)}), Counts(0, 2));
  EXPECT_EQ(told_and_described({law(3, 900.0), law(3, 800.0), law(3, 700.0)}), Counts(0, 3));
}

TEST(KnownForm, TwoOfOneAxisThatDoEachOthersWorkAreDescribed) {
  std::vector<DiscoveredLaw> laws = {law(3, 900.0), law(3, 800.0), law(0, 2000.0)};
  laws[0].overlap = laws[1].overlap = 0.3;
  EXPECT_EQ(told_and_described(laws), Counts(3, 0));
  laws[0].overlap = laws[1].overlap = 0.4;
  EXPECT_EQ(told_and_described(laws), Counts(1, 2));
}

TEST(KnownForm, TwoTermsOfOneLawAreDescribed) {
  std::vector<DiscoveredLaw> laws = {law(5, 900.0), law(5, 800.0)};
  const auto told = [&](std::string_view one, std::string_view other) {
    follow(laws[0], one);
    follow(laws[1], other);
    return tell_laws(laws, {}, departure_rate).told.size();
  };
  EXPECT_EQ(told("sin(outer)**3*sin(2*outer)", "sin(3*outer)*sin(outer)**2"), 0U);
  EXPECT_EQ(told("fx*abs(si)", "si*fx**2"), 0U);
  EXPECT_EQ(told("fx*abs(si)", "fx**2"), 2U);
  laws[1].term.axis = 4;
  EXPECT_EQ(told("fx", "fx**2"), 2U);
}

TEST(KnownForm, AnAxisThatHoldsMoreThanItsLawIsDescribed) {
  DiscoveredLaw lacks = law(4, 700.0);
  lacks.lack_log_p = std::log(departure_rate) - 0.1;
  EXPECT_EQ(told_and_described({lacks, law(0, 900.0)}), Counts(1, 1));
  lacks.lack_log_p = std::log(departure_rate) + 0.1;
  EXPECT_EQ(told_and_described({lacks, law(0, 900.0)}), Counts(2, 0));
}

TEST(KnownForm, AWaveThatKeepsStepWithTheTurnsIsDescribed) {
  DiscoveredLaw wave = law(1, 900.0);
  wave.in_step = true;
  const TellingLaws t = tell_laws({wave, law(0, 2000.0)}, {}, departure_rate);
  EXPECT_EQ(t.told.size(), 1U);
  ASSERT_EQ(t.described.size(), 1U);
  EXPECT_THAT(t.described.front().why, testing::StartsWith("it keeps step with the turns"));
}

// Nineteen turns, 155 s apart: periods of 150.9 to 159.4 s are within half a period of theirs over all.
TEST(StepWithTurns, IsResolvedByAllTurnsTogether) {
  std::vector<selfcal::diagnosis::Turn> turns;
  for (int k = 0; k < 19; ++k) {
    turns.push_back({150.0 + 155.0 * k, 155.0 + 155.0 * k});
  }
  EXPECT_TRUE(in_step(turns, 155.0));
  EXPECT_TRUE(in_step(turns, 159.0));
  EXPECT_FALSE(in_step(turns, 160.0));
  EXPECT_FALSE(in_step(turns, 150.0));
  EXPECT_TRUE(in_step(turns, 155.0 / 2.0));
  EXPECT_TRUE(in_step(turns, 155.0 / 3.0));
  EXPECT_FALSE(in_step(turns, 2.0 * 155.0));
  turns[7].start_s += 10.0;  // one dwell is longer than the next
  EXPECT_FALSE(in_step(turns, 155.0));
  turns.resize(3);
  EXPECT_FALSE(in_step(turns, 155.0));
}

// What is described says why, and what is told says nothing.
TEST(KnownForm, WhatIsDescribedSaysWhy) {
  DiscoveredLaw departs = law(4, 700.0);
  departs.departure_log_p = -20.0;
  departs.departs_with = "abs(wx)";
  const TellingLaws t = tell_laws({law(0, 900.0), departs, law(1, 100.0)}, {}, departure_rate);
  ASSERT_EQ(t.told.size(), 1U);
  ASSERT_EQ(t.described.size(), 2U);
  EXPECT_EQ(t.told.front().why, "");
  EXPECT_EQ(t.described.front().why, "its form departs from the axis with abs(wx)");
  EXPECT_EQ(t.described.back().why, "it may be what a stronger described one lacks");
}

TEST(KnownForm, AWeakLawThatIsUnsureElsewhereIsTold) {
  EXPECT_EQ(told_and_described({law(3, 100.0, 0.33)}), Counts(1, 0));
}

TEST(KnownForm, AStrongLawAloneThatMoreProbablyFailsElsewhereIsDescribedAsUnsure) {
  const TellingLaws t = tell_laws({law(3, 900.0, 0.49)}, {}, departure_rate);
  ASSERT_EQ(t.described.size(), 1U);
  EXPECT_TRUE(t.described.front().unsure);
  EXPECT_EQ(told_and_described({law(3, 900.0, 0.51)}), Counts(1, 0));
  EXPECT_EQ(told_and_described({law(3, 900.0, 0.33), law(0, 800.0)}), Counts(2, 0));
}

// What departs is none of its class, and no experiment is to part that.
TEST(KnownForm, WhatDepartsIsNotUnsure) {
  DiscoveredLaw departs = law(4, 900.0, 0.33);
  departs.departure_log_p = -20.0;
  const TellingLaws t = tell_laws({departs}, {}, departure_rate);
  ASSERT_EQ(t.described.size(), 1U);
  EXPECT_FALSE(t.described.front().unsure);
}

TEST(KnownForm, WhatDepartsTakesItsWholeAxisAlong) {
  DiscoveredLaw departs = law(4, 700.0);
  departs.departure_log_p = std::log(departure_rate) - 0.1;
  EXPECT_EQ(told_and_described({law(4, 900.0), departs}), Counts(0, 2));
  departs.departure_log_p = std::log(departure_rate) + 0.1;
  EXPECT_EQ(told_and_described({law(4, 900.0), departs}), Counts(2, 0));
}

TEST(KnownForm, WhatIsWeakerThanADescribedAxisIsDescribed) {
  DiscoveredLaw departs = law(4, 700.0);
  departs.departure_log_p = -20.0;
  EXPECT_EQ(told_and_described({law(0, 900.0), departs, law(1, 100.0)}), Counts(1, 2));
}

TEST(KnownForm, AWeakLawThatMayFollowTheStrongOnesAxisIsItsShadow) {
  DiscoveredLaw weak = law(2, 60.0);
  weak.ambiguous.push_back({"fy", 1, 0.2, {}});
  EXPECT_EQ(told_and_described({law(1, 900.0), weak}), Counts(0, 2));
  weak.ambiguous.back().odds = 0.04;  // of 1.04: 3.8 %
  EXPECT_EQ(told_and_described({law(1, 900.0), weak}), Counts(2, 0));
  weak.ambiguous.back().odds = 0.2;
  weak.gain = 100.0;  // more than a tenth: a law of its own
  EXPECT_EQ(told_and_described({law(1, 900.0), weak}), Counts(2, 0));
}

TEST(KnownForm, AProcessOnAnAxisLeavesItsFormOpen) {
  DiscoveredProcess jumps;
  jumps.axis = 5;
  EXPECT_EQ(told_and_described({law(5, 900.0), law(0, 1000.0)}, {jumps}), Counts(1, 1));
  EXPECT_EQ(told_and_described({law(4, 900.0)}, {jumps}), Counts(1, 0));
}

}  // namespace
