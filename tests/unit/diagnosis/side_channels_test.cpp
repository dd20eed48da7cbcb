// Read-outs and temperatures that are wrong for a while are mended and said; sound ones, late ones and coarse ones are left as they are.
#include "estimator/diagnosis/data/side_channels.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/estimator/simulated.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0, dwell_s = 20.0, turn_s = 5.0;

const Recording& sound() {
  static const Recording recording = [] {
    sim::SimConfig config = test::thrice_table5();
    config.sample_rate_hz = rate_hz;
    return *sim::simulate(config, *named_schedule("horizontal", dwell_s, turn_s), 11, {});
  }();
  return recording;
}

MendedSideChannels mend(const Recording& r, std::span<const double> temperature = {}) {
  ImuData data = test::view_of(r);
  data.temperature = temperature;
  return mend_side_channels(data);
}

std::size_t at(double seconds) { return static_cast<std::size_t>(seconds * rate_hz); }

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::abs(std::remainder(a[i] - b[i], 2.0 * std::numbers::pi)));
  }
  return largest;
}

TEST(SideChannels, SoundOnesAreLeftAsTheyAre) { EXPECT_TRUE(mend(sound()).faults.empty()); }

TEST(SideChannels, ASampleThatJumpsLiesBetweenItsNeighbours) {
  for (const double seconds : {10.0, 22.5, 131.3}) {  // in a dwell and in turns
    Recording r = sound();
    r.gimbal_outer_rad[at(seconds)] += 1.0;
    r.gimbal_inner_rad[at(seconds) + 40] -= 0.7;
    const MendedSideChannels mended = mend(r);
    ASSERT_EQ(mended.faults.size(), 2U) << seconds;
    EXPECT_EQ(mended.faults[0].id, "read_out");
    EXPECT_EQ(mended.faults[0].first_sample, at(seconds));
    // In a turn a rate of 36 deg/s changes by less than 1 deg/s from sample to sample.
    EXPECT_LT(largest_difference(mended.outer, sound().gimbal_outer_rad), 0.02 * std::numbers::pi / 180.0);
    EXPECT_LT(largest_difference(mended.inner, sound().gimbal_inner_rad), 0.02 * std::numbers::pi / 180.0);
  }
}

// From the middle of a dwell through three turns into the middle of another one.
TEST(SideChannels, ThroughAHoldTheGyrosTurn) {
  Recording r = sound();
  const std::size_t first = at(35.0), last = at(110.0);
  for (std::size_t i = first; i < last; ++i) {
    r.gimbal_outer_rad[i] = r.gimbal_outer_rad[first];
  }
  const MendedSideChannels mended = mend(r);
  ASSERT_EQ(mended.faults.size(), 1U);
  EXPECT_NE(mended.faults[0].words.find("gimbal_outer_rad holds one value"), std::string::npos)
      << mended.faults[0].words;
  // Misaligned axes of some arcminutes and the Earth's rate.
  EXPECT_LT(largest_difference(mended.outer, sound().gimbal_outer_rad), 0.5 * std::numbers::pi / 180.0);
}

TEST(SideChannels, LateReadOutsAreNoFault) {
  Recording r = sound();
  const auto late = static_cast<std::ptrdiff_t>(at(0.6));
  for (auto* angles : {&r.gimbal_outer_rad, &r.gimbal_inner_rad}) {
    std::rotate(angles->begin(), angles->end() - late, angles->end());
    std::fill(angles->begin(), angles->begin() + late, (*angles)[static_cast<std::size_t>(late)]);
  }
  EXPECT_TRUE(mend(r).faults.empty());
}

// Behind rows that are lost in a turn an angle is another one, and no sample has jumped.
TEST(SideChannels, LostRowsAreNoJump) {
  Recording r = sound();
  const auto first = static_cast<std::ptrdiff_t>(at(dwell_s + 0.4 * turn_s)), last = first + 17;
  r.time_s.erase(r.time_s.begin() + first, r.time_s.begin() + last);
  r.delta_theta_rad.erase(r.delta_theta_rad.begin() + first, r.delta_theta_rad.begin() + last);
  r.delta_v_mps.erase(r.delta_v_mps.begin() + first, r.delta_v_mps.begin() + last);
  for (auto* angles : {&r.gimbal_outer_rad, &r.gimbal_inner_rad}) {
    angles->erase(angles->begin() + first, angles->begin() + last);
  }
  EXPECT_TRUE(mend(r).faults.empty());
}

TEST(SideChannels, ACircleBeginsAnew) {
  Recording r = sound();
  for (double& angle : r.gimbal_outer_rad) {
    angle = std::remainder(angle, 2.0 * std::numbers::pi);
  }
  EXPECT_TRUE(mend(r).faults.empty());
}

// A block that warms by 8 degrees, read to a sixteenth with some noise.
std::vector<double> warming(double noise, double quantum) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<double> temperature;
  for (std::size_t i = 0; i < sound().time_s.size(); ++i) {
    const double t = 30.0 - 8.0 * std::exp(-static_cast<double>(i) / (200.0 * rate_hz)) + noise * normal(random);
    temperature.push_back(quantum * std::round(t / quantum));
  }
  return temperature;
}

TEST(SideChannels, TemperaturesThatDropOut) {
  for (const auto& [first, last] : {std::pair(at(100.0), at(100.0) + 1), std::pair(at(100.0), at(106.0)),
                                    std::pair(std::size_t{0}, at(2.0)), std::pair(at(460.0), sound().time_s.size())}) {
    const std::vector<double> was = warming(0.02, 0.0625);
    std::vector<double> temperature = was;
    std::fill(temperature.begin() + static_cast<std::ptrdiff_t>(first),
              temperature.begin() + static_cast<std::ptrdiff_t>(last), 0.0);
    const MendedSideChannels mended = mend(sound(), temperature);
    ASSERT_EQ(mended.faults.size(), 1U) << first;
    EXPECT_EQ(mended.faults[0].id, "temperature");
    EXPECT_EQ(mended.faults[0].count, last - first);
    for (std::size_t i = 0; i < was.size(); ++i) {
      ASSERT_NEAR(mended.temperature[i], was[i], 0.4) << i;  // it warms by up to 0.04 a second
    }
  }
}

TEST(SideChannels, NoisyAndCoarseTemperaturesAreNoFault) {
  for (const auto& [noise, quantum] :
       {std::pair(0.0, 1.0), std::pair(0.5, 1.0), std::pair(0.3, 0.01), std::pair(0.0, 2.0)}) {
    EXPECT_TRUE(mend(sound(), warming(noise, quantum)).faults.empty()) << noise << ", " << quantum;
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
