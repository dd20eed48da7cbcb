// Clipping against a rate that is steady to below the quantum, and gyros that are stuck or spike against quiet ones: only the first are faults.
#include "estimator/diagnosis/data/faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

struct Samples {
  std::vector<double> time;
  std::vector<std::array<double, 3>> theta, velocity;

  std::vector<DataFault> faults(double latitude) const {
    ImuData data;
    data.site = {latitude, 2.0, 0.0};
    data.sample_rate_hz = 1.0 / (time[1] - time[0]);
    data.time_s = time;
    data.delta_theta = theta;
    data.delta_v = velocity;
    return find_data_faults(data);
  }
};

// Dwells of 20 s between turns of 5 s about z at 25.7 deg/s, ramps half cosines of 1.5 s; counts of 0.1", clipped.
struct Turning : Samples {
  // `across`: share of the turns that y has; it is noisy by a count.
  explicit Turning(double rate_hz, double clip_deg_per_s, double across = 0.0) {
    std::mt19937 random(1);
    std::uniform_int_distribution<int> noise(-1, 1);
    constexpr double quantum = 0.1 * units::arcsecond, plateau = 90.0 / 3.5 * units::degree;
    double carried = 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(250.0 * rate_hz); ++i) {
      const double t = std::fmod(static_cast<double>(i) / rate_hz, 25.0) - 20.0;
      const double edge = std::clamp(std::min(t, 5.0 - t) / 1.5, 0.0, 1.0);
      const double rate = plateau * 0.5 * (1.0 - std::cos(std::numbers::pi * edge));
      carried += std::min(rate, clip_deg_per_s * units::degree) / rate_hz;
      const double count = std::round(carried / quantum);
      carried -= count * quantum;
      time.push_back(static_cast<double>(i + 1) / rate_hz);
      const double y = across > 0.0 ? std::round(across * count) + noise(random) : 0.0;
      theta.push_back({0.0, y * quantum, count * quantum});
      velocity.push_back({1e-7 * static_cast<double>(i % 7), 0.0, 9.8 / rate_hz + 1e-6 * static_cast<double>(i % 5)});
    }
  }
  bool saturated() const {
    const std::vector<DataFault> found = faults(0.7);
    return std::any_of(found.begin(), found.end(), [](const DataFault& f) { return f.id == "saturation"; });
  }
};

TEST(DataFaults, ASteadyRateIsNotSaturation) {
  for (const double rate_hz : {50.0, 100.0, 200.0}) {
    EXPECT_FALSE(Turning(rate_hz, 100.0).saturated()) << rate_hz << " Hz";
  }
}

// An axis across the turns has 2 % of them, some hundred counts: two counts of noise are no slope that the top cuts off.
TEST(DataFaults, AFewCountsOfNoiseAreNoSlope) {
  for (const double rate_hz : {50.0, 100.0, 200.0}) {
    EXPECT_FALSE(Turning(rate_hz, 100.0, 0.02).saturated()) << rate_hz << " Hz";
    EXPECT_FALSE(Turning(rate_hz, 100.0, 0.03).saturated()) << rate_hz << " Hz";
  }
}

TEST(DataFaults, AClippedRateIs) {
  for (const double rate_hz : {50.0, 100.0, 200.0}) {
    EXPECT_TRUE(Turning(rate_hz, 20.0).saturated()) << rate_hz << " Hz";
  }
}

// Gyro y stands upright near the equator: 0.02" of turning a second, counted by 0.5", with white noise of a hundredth of a count.
Samples quiet_and_coarse() {
  Samples s;
  constexpr double rate_hz = 100.0, quantum = 0.5 * units::arcsecond;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const std::array<double, 3> rate{8.0, -0.02, 12.0};  // arcsec/s
  std::array<double, 3> angle{}, counted{};
  for (std::size_t i = 0; i < 120000; ++i) {
    s.time.push_back(static_cast<double>(i + 1) / rate_hz);
    s.theta.emplace_back();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      angle[axis] += (rate[axis] / rate_hz + 0.005 * normal(random)) * units::arcsecond;
      const double count = std::floor(angle[axis] / quantum);
      s.theta.back()[axis] = (count - counted[axis]) * quantum;
      counted[axis] = count;
    }
    s.velocity.push_back({5e-6 * normal(random), 9.78 / rate_hz + 5e-6 * normal(random), 5e-6 * normal(random)});
  }
  return s;
}

TEST(DataFaults, AQuietGyroRestsAtACountAndItsCountsAreNoSpikes) {
  const Samples samples = quiet_and_coarse();
  std::size_t longest = 0, run = 0, counts = 0;
  for (const auto& angle : samples.theta) {
    counts += angle[1] != 0.0 ? 1 : 0;
    run = angle[1] == 0.0 ? run + 1 : 0;
    longest = std::max(longest, run);
  }
  ASSERT_GT(longest, 3000U);  // 30 s
  ASSERT_GT(counts, 20U);
  const std::vector<DataFault> sound = samples.faults(0.0);
  EXPECT_TRUE(sound.empty()) << sound.front().words;
  // One that rests for longer than such a gyro does is stuck; what stands out by counts is a spike.
  Samples dead = samples;
  for (std::size_t i = 20000; i < 118000; ++i) {
    dead.theta[i][1] = 0.0;
  }
  const std::vector<DataFault> stuck = dead.faults(0.0);
  ASSERT_EQ(stuck.size(), 1U);
  EXPECT_EQ(stuck.front().id, "frozen_axis");
  Samples struck = samples;
  struck.theta[30000][1] += 20.0 * 0.5 * units::arcsecond;
  const std::vector<DataFault> spike = struck.faults(0.0);
  ASSERT_EQ(spike.size(), 1U);
  EXPECT_EQ(spike.front().id, "spike");
}

// Specific force of very nearly one count a sample: one value for seconds on end, again and again.
TEST(DataFaults, AnAccelerometerRestsAtACount) {
  Samples samples = quiet_and_coarse();
  constexpr double rate_hz = 100.0, quantum = 5e-4;
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  double velocity = 0.0, counted = 0.0;
  std::size_t longest = 0, run = 0;
  for (auto& v : samples.velocity) {
    velocity += 1.002 * quantum + 1e-5 / std::sqrt(rate_hz) * normal(random);
    const double count = std::floor(velocity / quantum);
    v[2] = (count - counted) * quantum;
    run = count - counted == 1.0 ? run + 1 : 0;
    longest = std::max(longest, run);
    counted = count;
  }
  ASSERT_GT(longest, 300U);  // 3 s
  const std::vector<DataFault> sound = samples.faults(0.0);
  EXPECT_TRUE(sound.empty()) << sound.front().words;
  // Stuck at another count than the rest of the dwell tells.
  Samples stuck = samples;
  for (std::size_t i = 40000; i < 41000; ++i) {
    stuck.velocity[i][2] = 2.0 * quantum;
  }
  const std::vector<DataFault> told = stuck.faults(0.0);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told.front().id, "frozen_axis");
  EXPECT_EQ(told.front().count, 1000U);
}

}  // namespace
}  // namespace selfcal::diagnosis
