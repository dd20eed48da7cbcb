// Logs in one pose and in a few, made here. What is said of many is measured by tests/rest.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "estimator/diagnosis/poses/poses.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 10.0, gyro_sigma = 1e-3, accel_sigma = 1e-2;  // of a sample

// White noise, and what `course` adds to gyro x at a time and a temperature.
struct Log {
  PoseInput input;
  std::mt19937 random{7};
  std::normal_distribution<double> normal;

  Log() { input.accel_unit = 1.0; }
  void stand(double seconds, const Vector3& u, const std::function<double(double)>& drift,
             const std::function<double(double)>& temperature = nullptr) {
    const double start = input.time_s.empty() ? 0.0 : input.time_s.back();
    for (int k = 0; k < static_cast<int>(seconds * rate_hz); ++k) {
      const double t = start + (k + 1) / rate_hz;
      input.time_s.push_back(t);
      input.gyro.push_back(
          {0.01 + drift(t) + gyro_sigma * normal(random), gyro_sigma * normal(random), gyro_sigma * normal(random)});
      const Vector3 f = 9.80665 * u;
      input.accel.push_back({f.x() + accel_sigma * normal(random), f.y() + accel_sigma * normal(random),
                             f.z() + accel_sigma * normal(random)});
      if (temperature) {
        input.temperature_c.push_back(temperature(t) + 0.05 * normal(random));
      }
    }
  }
  void shake(double seconds) {
    for (int k = 0; k < static_cast<int>(seconds * rate_hz); ++k) {
      input.time_s.push_back(input.time_s.back() + 1.0 / rate_hz);
      input.gyro.push_back({normal(random), normal(random), normal(random)});
      input.accel.push_back({10 * normal(random), 10 * normal(random), 10 * normal(random)});
    }
  }
};

double none(double /*t*/) { return 0.0; }

const RestAxis& gyro_x(const PoseDiagnosis& d) { return d.rest->axes[0]; }

TEST(Rest, OfWhiteNoiseNamesNothingAndKnowsTheMean) {
  Log log;
  log.stand(1800.0, Vector3::UnitZ(), none);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.failure.empty()) << d.failure;
  ASSERT_TRUE(d.rest);
  EXPECT_EQ(d.rest->axes.size(), 6u);
  for (const RestAxis& a : d.rest->axes) {
    EXPECT_TRUE(a.terms.empty());
    EXPECT_TRUE(std::isnan(a.walk));
    // The density of white noise is sigma sqrt(dt), to 5 % by 1800 means of a second and three other times.
    const double sigma = a.gyro ? gyro_sigma : accel_sigma;
    EXPECT_NEAR(a.white_asd * std::sqrt(rate_hz) / sigma, 1.0, 0.15);
    // No less than white noise leaves of the mean, and not many times that.
    const double of_mean = sigma / std::sqrt(1800.0 * rate_hz);
    EXPECT_GT(a.mean_sigma, 0.9 * of_mean);
    EXPECT_LT(a.mean_sigma, 6.0 * of_mean);
  }
  EXPECT_NEAR(gyro_x(d).mean, 0.01, 4.0 * gyro_x(d).mean_sigma);
  EXPECT_LE(d.invisible.size(), 5u);
}

TEST(Rest, NamesWhatFollowsATemperatureThatComesBack) {
  Log log;
  const auto temperature = [](double t) { return 20.0 + 40.0 * (1.0 - std::abs(2.0 * t / 1800.0 - 1.0)); };
  constexpr double truth = 5e-5;  // rad/s per degC: 2e-3 over the log, 2 sigma of a sample
  log.stand(
      1800.0, Vector3::UnitZ(), [&](double t) { return truth * (temperature(t) - 40.0); }, temperature);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  ASSERT_EQ(gyro_x(d).terms.size(), 1u);
  const RestTerm& t = gyro_x(d).terms.front();
  EXPECT_EQ(t.found.equation.id, "gyro_temperature");
  EXPECT_EQ(t.found.equation.unit, "deg/h/degC");
  EXPECT_TRUE(t.as_well.empty());
  EXPECT_NEAR(t.found.value, truth, 4.0 * t.found.sigma);
  EXPECT_LT(t.found.sigma, 0.05 * truth);
  EXPECT_GT(t.share, 0.9);
  for (std::size_t k = 1; k < 6; ++k) {
    EXPECT_TRUE(d.rest->axes[k].terms.empty());
  }
}

TEST(Rest, ATemperatureThatGoesWithTimeIsConfounded) {
  Log log;
  const auto temperature = [](double t) { return 20.0 + 30.0 * t / 1800.0; };
  log.stand(
      1800.0, Vector3::UnitZ(), [&](double t) { return 5e-5 * temperature(t); }, temperature);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  ASSERT_EQ(gyro_x(d).terms.size(), 1u);
  EXPECT_EQ(gyro_x(d).terms.front().found.equation.id, "gyro_temperature");
  ASSERT_FALSE(gyro_x(d).terms.front().as_well.empty());
  EXPECT_EQ(gyro_x(d).terms.front().as_well.front().equation.id, "gyro_drift_ramp");
}

TEST(Rest, ARampWithoutAChannelHasItsRate) {
  Log log;
  constexpr double truth = 2e-3 / 1800.0;
  log.stand(1800.0, Vector3::UnitZ(), [](double t) { return truth * t; });
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  ASSERT_EQ(gyro_x(d).terms.size(), 1u);
  EXPECT_EQ(gyro_x(d).terms.front().found.equation.id, "gyro_drift_ramp");
  EXPECT_NEAR(gyro_x(d).terms.front().found.value, truth, 4.0 * gyro_x(d).terms.front().found.sigma);
}

// A cheap gyro's bias may go by degrees a second with the temperature; what changes within seconds only moves.
TEST(Rest, ABiasThatGoesFarIsNoMotion) {
  Log log;
  const auto temperature = [](double t) { return 20.0 + 80.0 * (1.0 - std::abs(2.0 * t / 1800.0 - 1.0)); };
  constexpr double truth = 1.5e-3;  // rad/s per degC: 0.12 rad/s, 7 deg/s in all
  log.stand(
      1800.0, Vector3::UnitZ(), [&](double t) { return truth * (temperature(t) - 60.0); }, temperature);
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest) << d.failure;
  ASSERT_FALSE(gyro_x(d).terms.empty());
  EXPECT_EQ(gyro_x(d).terms.front().found.equation.id, "gyro_temperature");
  EXPECT_NEAR(gyro_x(d).terms.front().found.value, truth, 0.01 * truth);
}

// Sigma of the difference of two means of 900 s of white noise is sqrt(2 / 9000) of a sample's.
constexpr double jump_sigma = 1.49e-2 * gyro_sigma;

TEST(Rest, ABiasThatJumpsIsNoDrift) {
  Log log;
  constexpr double truth = 30.0 * jump_sigma, at_s = 700.0;  // 5 sigma of a block of 15 s: less may be a walk
  log.stand(1800.0, Vector3::UnitZ(), [](double t) { return t > at_s ? truth : 0.0; });
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  ASSERT_EQ(gyro_x(d).terms.size(), 1u);
  const RestAmplitude& found = gyro_x(d).terms.front().found;
  EXPECT_EQ(found.equation.id, "gyro_bias_jump");
  EXPECT_NEAR(found.value, truth, 4.0 * found.sigma);
  EXPECT_LT(found.sigma, 2.5 * jump_sigma);  // slow noise that may be there besides
  EXPECT_NEAR(found.constant, at_s, 4.0 * found.constant_sigma);
  EXPECT_LT(found.constant_sigma, 60.0);
  for (std::size_t k = 1; k < 6; ++k) {
    EXPECT_TRUE(d.rest->axes[k].terms.empty());
  }
}

TEST(Rest, ABiasMayJumpTwice) {
  Log log;
  constexpr double first = 30.0 * jump_sigma, second = -20.0 * jump_sigma;
  log.stand(1800.0, Vector3::UnitZ(), [](double t) { return (t > 500.0 ? first : 0.0) + (t > 1300.0 ? second : 0.0); });
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  ASSERT_EQ(gyro_x(d).terms.size(), 2u);
  for (const RestTerm& t : gyro_x(d).terms) {
    const bool early = t.found.constant < 900.0;
    EXPECT_EQ(t.found.equation.id, "gyro_bias_jump");
    EXPECT_NEAR(t.found.value, early ? first : second, 4.0 * t.found.sigma);
    EXPECT_NEAR(t.found.constant, early ? 500.0 : 1300.0, 4.0 * t.found.constant_sigma);
  }
}

// The control: the same size as a ramp's, but a walk's. An equation named of it were a false alarm.
TEST(Rest, AWalkIsNoDrift) {
  Log log;
  double state = 0.0;
  log.stand(1800.0, Vector3::UnitZ(),
            [&](double) { return state += 2e-3 / std::sqrt(1800.0 * rate_hz) * log.normal(log.random); });
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  EXPECT_TRUE(gyro_x(d).terms.empty());
  ASSERT_FALSE(std::isnan(gyro_x(d).walk));
  const double density = 2e-3 / std::sqrt(1800.0);
  EXPECT_NEAR(gyro_x(d).walk, density, 0.5 * density);  // 120 blocks beside as much white noise as they step by
}

TEST(Rest, AFewPosesHaveAConstantEach) {
  Log log;
  log.stand(300.0, Vector3::UnitZ(), none);
  log.shake(5.0);
  log.stand(300.0, Vector3::UnitX(), [](double) { return 1e-3; });  // what the Earth's rate does, say
  log.shake(5.0);
  log.stand(600.0, Vector3::UnitY(), [](double) { return -1e-3; });
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  EXPECT_EQ(d.poses, 3);
  EXPECT_TRUE(gyro_x(d).terms.empty());
  EXPECT_NEAR(gyro_x(d).mean, 0.009, 4.0 * gyro_x(d).mean_sigma);  // of the longest
}

TEST(Rest, AChannelThatIsNoiseIsNone) {
  Log log;
  log.stand(600.0, Vector3::UnitZ(), none, [](double) { return 25.0; });
  const PoseDiagnosis d = diagnose_poses(log.input, 0.01);
  ASSERT_TRUE(d.rest);
  EXPECT_FALSE(d.rest->coldest);
  EXPECT_THAT(d.invisible, testing::Contains(testing::HasSubstr("by no more than its noise")));
}

}  // namespace
}  // namespace selfcal::diagnosis
