// Faults on demand: what a scenario file says is what happens, when it says so, and the same seed does the same.
#include <gmock/gmock.h>

#include <cstdio>
#include <fstream>

#include "estimator/geometry/units.hpp"
#include "sim_ins/device/scenario.hpp"

namespace selfcal::sim {
namespace {

using testing::HasSubstr;

Expected<Scenario> scenario_of(const std::string& text) {
  const std::string path = testing::TempDir() + "scenario.toml";
  std::ofstream(path) << text;
  auto scenario = read_scenario(path);
  std::remove(path.c_str());
  return scenario;
}

can::CanFrame numbered(std::uint8_t number) {
  can::CanFrame frame;
  frame.id = 0x648;
  frame.size = 8;
  frame.data[0] = number;
  return frame;
}

std::vector<can::CanFrame> passed(const std::string& text, int count, double t) {
  FaultyBus bus(*scenario_of(text));
  std::vector<can::CanFrame> out;
  for (int k = 0; k < count; ++k) {
    bus.pass(numbered(static_cast<std::uint8_t>(k)), t, out);
  }
  return out;
}

TEST(Scenario, FramesAreLostInTheirTimeOnlyAndBySeed) {
  const std::string text = "seed = 4\n[[fault]]\nkind='drop'\nat_s=10\nfor_s=5\nprobability=0.5\n";
  EXPECT_EQ(passed(text, 200, 9.9).size(), 200U);
  EXPECT_EQ(passed(text, 200, 15.0).size(), 200U);
  const auto half = passed(text, 200, 12.0);
  EXPECT_NEAR(static_cast<double>(half.size()), 100.0, 35.0);  // 5 sigma of 200 coin tosses
  EXPECT_EQ(half, passed(text, 200, 12.0));
  EXPECT_NE(half, passed("seed = 5" + text.substr(8), 200, 12.0));
}

TEST(Scenario, DuplicateReorderCorruptDelay) {
  const auto twice = passed("[[fault]]\nkind='duplicate'\n", 2, 0.0);
  EXPECT_THAT(twice, testing::ElementsAre(numbered(0), numbered(0), numbered(1), numbered(1)));
  const auto swapped = passed("[[fault]]\nkind='reorder'\n", 2, 0.0);
  EXPECT_THAT(swapped, testing::ElementsAre(numbered(1), numbered(0)));
  const auto spoilt = passed("[[fault]]\nkind='corrupt'\n", 1, 0.0);
  ASSERT_EQ(spoilt.size(), 1U);
  EXPECT_NE(spoilt[0], numbered(0));

  FaultyBus counted(*scenario_of("[[fault]]\nkind='duplicate'\n[[fault]]\nkind='drop'\nprobability=0\n"));
  std::vector<can::CanFrame> ignored;
  counted.pass(numbered(1), 0.0, ignored);
  EXPECT_EQ(counted.tally(), "duplicate 1");

  FaultyBus late(*scenario_of("[[fault]]\nkind='delay'\namount=0.5\n"));
  std::vector<can::CanFrame> out;
  late.pass(numbered(7), 1.0, out);
  late.flush(1.4, out);
  EXPECT_TRUE(out.empty());
  late.flush(1.5, out);
  EXPECT_THAT(out, testing::ElementsAre(numbered(7)));
}

TEST(Scenario, GimbalGoesWrongAndIsNoticed) {
  GimbalConfig config;
  config.positioning_error_deg = 0.0;
  const Schedule schedule = *named_schedule("horizontal", 10.0);
  Random random(1, 2);
  const GimbalMotion planned = plan_gimbal(config, schedule, random);
  const auto angle_after = [&](const char* text, double t) {
    return spoil_gimbal(*scenario_of(text), planned).at(t).angle[0] / units::degree;
  };
  EXPECT_NEAR(planned.at(30.0).angle[0] / units::degree, 180.0, 1e-9);
  EXPECT_NEAR(angle_after("[[fault]]\nkind='stuck_gimbal'\nvalue=2\n", 30.0), 90.0, 1e-9);
  EXPECT_NEAR(angle_after("[[fault]]\nkind='overshoot'\nvalue=2\namount=7\n", 30.0), 187.0, 1e-9);
  EXPECT_NEAR(angle_after("[[fault]]\nkind='wrong_direction'\nvalue=2\n", 30.0), 0.0, 1e-9);
  // The second move ends after two dwells of 10 s and two moves of 5 s; it is noticed 2 s later.
  EXPECT_DOUBLE_EQ(*gimbal_failure_time(*scenario_of("[[fault]]\nkind='stuck_gimbal'\nvalue=2\n"), schedule), 32.0);
  EXPECT_FALSE(
      gimbal_failure_time(*scenario_of("[[fault]]\nkind='stuck_gimbal'\nvalue=2\ndetected=false\n"), schedule));
  // By time: at 12 s the first move is under way and ends, the second, due at 25 s, is never begun.
  const char* by_time = "[[fault]]\nkind='stuck_gimbal'\nat_s=12\n";
  EXPECT_NEAR(angle_after(by_time, 30.0), 90.0, 1e-9);
  EXPECT_DOUBLE_EQ(*gimbal_failure_time(*scenario_of(by_time), schedule), 32.0);
}

TEST(Scenario, SensorsSaturateAndFreeze) {
  ImuSample before;
  before.delta_v = {1, 2, 3};
  ImuSample sample;
  sample.delta_theta = {5000, -5000, 10};
  sample.delta_v = {4, 5, 6};
  ImuSample limited = sample;
  EXPECT_TRUE(
      spoil_sample(*scenario_of("[[fault]]\nkind='saturated_gyro'\nvalue=1\namount=4000\n"), 0.0, before, limited));
  EXPECT_EQ(limited.delta_theta[1], -4000);
  EXPECT_EQ(limited.delta_theta[0], 5000);
  ImuSample frozen = sample;
  EXPECT_FALSE(spoil_sample(*scenario_of("[[fault]]\nkind='frozen_accel'\nvalue=2\n"), 0.0, before, frozen));
  EXPECT_THAT(frozen.delta_v, testing::ElementsAre(4, 5, 3));
  ImuSample untouched = sample;
  EXPECT_FALSE(spoil_sample(*scenario_of("[[fault]]\nkind='frozen_accel'\nat_s=9\n"), 0.0, before, untouched));
}

TEST(Scenario, CountsFromTheFirstTimeInAState) {
  Scenario scenario = *scenario_of("[[fault]]\nkind='bus_off'\nstate='rotating'\nat_s=5\nfor_s=2\n");
  const auto off = [&](double t) { return scenario.active(FaultKind::bus_off, t) != nullptr; };
  scenario.note_state(ins::State::idle, 10.0);
  EXPECT_FALSE(off(6.0) || off(16.0));
  scenario.note_state(ins::State::rotating, 100.0);
  scenario.note_state(ins::State::rotating, 103.0);  // still, or again: counted from the first time
  EXPECT_FALSE(off(104.9));
  EXPECT_TRUE(off(105.0));
  EXPECT_FALSE(off(107.0));
}

TEST(Scenario, FilesNameWhatIsWrong) {
  const auto message = [](const char* text) {
    const auto scenario = scenario_of(text);
    return scenario ? std::string("accepted") : scenario.error().message;
  };
  EXPECT_THAT(message("[[fault]]\nkind = 'gremlins'\n"),
              HasSubstr("scenario.toml:2: fault[0].kind: no fault is called 'gremlins'"));
  EXPECT_THAT(message("[[fault]]\nkind = 'drop'\nprobability = 2\n"),
              HasSubstr("scenario.toml:3: fault[0].probability: 2 is outside [0, 1]"));
  EXPECT_THAT(message("[[fault]]\nkind = 'drop'\nwhen = 2\n"),
              HasSubstr("scenario.toml:3: fault[0].when: no such key"));
  EXPECT_THAT(message("[[fault]]\nkind = 'drop'\nstate = 'asleep'\n"),
              HasSubstr("scenario.toml:3: fault[0].state: 'asleep' is no state of the INS"));
  EXPECT_THAT(message("[[fault]]\nkind = 'frozen_gyro'\nstate = 'rotating'\n"),
              HasSubstr("scenario.toml:3: fault[0].state: frozen_gyro counts from the start of the rotation already"));
}

}  // namespace
}  // namespace selfcal::sim
