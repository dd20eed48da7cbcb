// Read-outs of the gimbal that come late, or early: by how much, and nothing where they do not.
#include "estimator/diagnosis/data/read_out_delay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/estimator/simulated.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 100.0;

Recording recording() {
  sim::SimConfig config = test::thrice_table5();
  config.sample_rate_hz = rate_hz;
  return *sim::simulate(config, *named_schedule("horizontal", 20.0, 5.0), 8, {});
}

std::optional<ReadOutDelay> delay_of(const Recording& r) {
  const ImuData data = test::view_of(r);
  return read_out_delay(data, find_segments(data));
}

// By so many samples, a fraction of one by a straight line.
std::vector<double> later(const std::vector<double>& angles, double samples) {
  std::vector<double> shifted(angles.size());
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double at = std::clamp(static_cast<double>(i) - samples, 0.0, static_cast<double>(angles.size() - 2));
    const auto first = static_cast<std::size_t>(at);
    shifted[i] = angles[first] + (at - static_cast<double>(first)) * (angles[first + 1] - angles[first]);
  }
  return shifted;
}

TEST(ReadOutDelay, NoneOfASoundRecording) { EXPECT_FALSE(delay_of(recording())); }

TEST(ReadOutDelay, IsFoundToAFractionOfASample) {
  const Recording sound = recording();
  for (const double samples : {3.0, 17.4, 80.0, -12.0}) {
    Recording late = sound;
    late.gimbal_outer_rad = later(sound.gimbal_outer_rad, samples);
    late.gimbal_inner_rad = later(sound.gimbal_inner_rad, samples);
    const auto delay = delay_of(late);
    ASSERT_TRUE(delay) << samples;
    EXPECT_NEAR(delay->delay_s, samples / rate_hz, std::max(5.0 * delay->sigma_s, 0.2 / rate_hz)) << samples;
    EXPECT_LT(delay->sigma_s, 0.5 / rate_hz);
  }
}

// A circle begins anew at 360 degrees; that is no motion.
TEST(ReadOutDelay, AnglesMayBeginAnew) {
  Recording late = recording();
  for (auto* angles : {&late.gimbal_outer_rad, &late.gimbal_inner_rad}) {
    *angles = later(*angles, 20.0);
    for (double& angle : *angles) {
      angle = std::remainder(angle, 2.0 * std::numbers::pi);
    }
  }
  const auto delay = delay_of(late);
  ASSERT_TRUE(delay);
  EXPECT_NEAR(delay->delay_s, 0.2, 0.002);
}

// What turns another way than the gyros is no late read-out.
TEST(ReadOutDelay, NoneOfAnotherMotion) {
  Recording other = recording();
  for (double& angle : other.gimbal_outer_rad) {
    angle *= 0.3;
  }
  EXPECT_FALSE(delay_of(other));
}

}  // namespace
}  // namespace selfcal::diagnosis
