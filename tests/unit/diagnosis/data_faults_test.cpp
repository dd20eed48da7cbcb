// Clipping against a rate that is steady to below the quantum: only the first is a fault.
#include "estimator/diagnosis/data/faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

// Dwells of 20 s between turns of 5 s about z at 25.7 deg/s, ramps half cosines of 1.5 s; counts of 0.1", clipped.
struct Turning {
  std::vector<double> time;
  std::vector<std::array<double, 3>> theta, velocity;

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
    ImuData data;
    data.site = {0.7, 2.0, 0.0};
    data.sample_rate_hz = 1.0 / (time[1] - time[0]);
    data.time_s = time;
    data.delta_theta = theta;
    data.delta_v = velocity;
    const std::vector<DataFault> faults = find_data_faults(data);
    return std::any_of(faults.begin(), faults.end(), [](const DataFault& f) { return f.id == "saturation"; });
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

}  // namespace
}  // namespace selfcal::diagnosis
