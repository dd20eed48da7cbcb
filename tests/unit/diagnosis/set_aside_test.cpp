// A fault in one stretch of a recording costs that stretch: it is left out, the rest is answered, and sigma is what the rest gives.
//
// What the rest gives is predicted by the planner, which knows nothing of stretches left out: of the schedule with the dwell
// shorter by what was lost, or, where the gyros miss a turn, of the two schedules before and behind it, information added up.
#include "estimator/diagnosis/data/set_aside.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/planning/remedy.hpp"
#include "tests/unit/estimator/simulated.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 100.0, dwell_s = 60.0, rotation_s = 5.0;
constexpr std::uint64_t seed = 5;
constexpr std::size_t dwell = 4;                                     // from 0
constexpr double stretch_s = (dwell_s + rotation_s) * dwell + 20.0;  // in the middle of that dwell
constexpr auto stretch = static_cast<std::size_t>(stretch_s * rate_hz);
constexpr double turn_s = (dwell_s + rotation_s) * dwell - rotation_s;  // the turn before it

Schedule schedule() { return *named_schedule("horizontal", dwell_s, rotation_s); }

sim::SimConfig config() {
  sim::SimConfig config = test::thrice_table5();
  config.sample_rate_hz = rate_hz;
  return config;
}

const Recording& clean() {
  static const Recording recording = *sim::simulate(config(), schedule(), seed, {});
  return recording;
}

struct Case {
  const char* name;
  std::function<void(Recording&)> spoil;
  const char* fault;
  double lost_s;  // of the dwell; 0: the turn before it
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

template <typename T>
void drop(std::vector<T>& all, std::size_t first, std::size_t count) {
  all.erase(all.begin() + static_cast<std::ptrdiff_t>(first), all.begin() + static_cast<std::ptrdiff_t>(first + count));
}

void stick(Recording& r) {
  for (std::size_t i = stretch; i < stretch + 2000; ++i) {
    r.delta_theta_rad[i][0] = r.delta_theta_rad[stretch][0];
  }
}
void lose(Recording& r) {
  for (std::size_t i = stretch; i < stretch + 300; ++i) {
    r.delta_theta_rad[i] = r.delta_v_mps[i] = {};
  }
}
void cut(Recording& r) {
  drop(r.time_s, stretch, 500);
  drop(r.delta_theta_rad, stretch, 500);
  drop(r.delta_v_mps, stretch, 500);
  drop(r.gimbal_outer_rad, stretch, 500);
  drop(r.gimbal_inner_rad, stretch, 500);
}
void spike(Recording& r) { r.delta_v_mps[stretch][1] += 0.01; }
// Of a few samples: it might be a knock, and is left out as one.
void burst(Recording& r) {
  for (std::size_t i = stretch; i < stretch + 3; ++i) {
    r.delta_v_mps[i][1] += 0.01;
  }
}
// The gyro that turns most, at six tenths of its largest rate.
void clip(Recording& r) {
  const auto first = static_cast<std::size_t>((turn_s - 1.0) * rate_hz);
  const auto last = static_cast<std::size_t>((turn_s + rotation_s + 1.0) * rate_hz);
  std::size_t axis = 0;
  double largest = 0.0;
  for (std::size_t i = first; i < last; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (std::abs(r.delta_theta_rad[i][a]) > largest) {
        largest = std::abs(r.delta_theta_rad[i][a]);
        axis = a;
      }
    }
  }
  for (std::size_t i = first; i < last; ++i) {
    double& w = r.delta_theta_rad[i][axis];
    w = std::clamp(w, -0.6 * largest, 0.6 * largest);
  }
}
// Ten minutes of arc in one sample of a turn.
void spike_in_turn(Recording& r) {
  r.delta_theta_rad[static_cast<std::size_t>((turn_s + 0.5 * rotation_s) * rate_hz)][2] += 3e-3;
}
// 2 mm at 3 Hz in the axis of the accelerometer, smooth at both ends: the base moves and comes back.
void shake(Recording& r) {
  const double w = 6.0 * std::numbers::pi;
  const auto position = [&](double t) {
    const double window = t > 0.0 && t < 5.0 ? std::pow(std::sin(std::numbers::pi * t / 5.0), 2) : 0.0;
    return 2e-3 * window * std::sin(w * t);
  };
  const double dt = 1.0 / rate_hz;
  for (std::size_t i = stretch; i < stretch + 500; ++i) {
    const double t = static_cast<double>(i - stretch) * dt;
    r.delta_v_mps[i][0] += (position(t + dt) - 2.0 * position(t) + position(t - dt)) / dt;
  }
}

ParameterMatrix information(const Schedule& part, const Installation& installation) {
  return predict(part, installation).covariance.inverse();
}

ParameterVector predicted(const Case& c, const Installation& installation) {
  if (c.lost_s > 0.0) {
    Schedule rest = schedule();
    rest.dwell_s[dwell] -= c.lost_s;
    return predict(rest, installation).sigma;
  }
  Schedule before = schedule(), behind = before;
  before.positions.resize(dwell);
  before.dwell_s.resize(dwell);
  behind.positions.erase(behind.positions.begin(), behind.positions.begin() + dwell);
  behind.dwell_s.erase(behind.dwell_s.begin(), behind.dwell_s.begin() + dwell);
  const ParameterMatrix prior = (2.0 * plausible_limit()).cwiseAbs2().cwiseInverse().asDiagonal();
  const ParameterMatrix sum = information(before, installation) + information(behind, installation) - prior;
  return sum.inverse().diagonal().cwiseSqrt();
}

class SetAsideFault : public testing::TestWithParam<Case> {};

TEST_P(SetAsideFault, CostsItsStretch) {
  const Case& c = GetParam();
  Recording recording = clean();
  c.spoil(recording);
  const SetAside aside(test::view_of(recording));
  ASSERT_EQ(aside.refused(), "");
  ASSERT_FALSE(aside.left_out().empty());
  const double at = c.lost_s > 0.0 ? stretch_s : turn_s;
  for (const LeftOut& l : aside.left_out()) {
    EXPECT_EQ(l.fault, c.fault) << l.words;
    EXPECT_EQ(l.turn, c.lost_s == 0.0);
    // The stretch, with a second of margin on either side where the edge is not a sample's.
    EXPECT_GT(l.start_s, at - 2.1);
    EXPECT_LT(l.end_s, at + std::max(c.lost_s, rotation_s) + 3.1);
  }

  const CalibrationOutcome outcome = calibrate(aside.data(), {});
  ASSERT_TRUE(outcome.result) << outcome.failure.message;
  const CalibrationResult& result = *outcome.result;
  const ParameterVector z = (result.value - test::truth_of(config(), seed)).cwiseQuotient(result.sigma);
  EXPECT_LT(z.cwiseAbs().maxCoeff(), 3.0) << z.transpose();
  // 3700 squares: 3.3 sigma of their mean are 0.08; the densities are estimates.
  EXPECT_NEAR(result.consistency.nis_mean, 1.0, 0.1);
  EXPECT_EQ(result.consistency.verdict, Verdict::consistent) << result.consistency.words;

  Installation installation = installation_of(result, aside.data().site, default_tolerance());
  const ParameterVector rest = predicted(c, installation);
  for (int k = 0; k < sensor_parameter_count; ++k) {
    EXPECT_NEAR(result.sigma(k) / rest(k), 1.0, 0.1) << sensor_parameters[static_cast<std::size_t>(k)].name;
    EXPECT_GE(result.sigma(k), 0.999 * result.sigma_whole(k)) << sensor_parameters[static_cast<std::size_t>(k)].name;
  }

  const DiagnosisOutcome named = diagnose(aside.data(), {});
  ASSERT_TRUE(named.diagnosis) << named.failure;
  EXPECT_FALSE(named.diagnosis->mismatch);
  EXPECT_NEAR(named.diagnosis->after.nis, 1.0, 0.1);

  const DiagnosisOutcome strict = diagnose(test::view_of(recording), {});
  ASSERT_TRUE(strict.diagnosis) << strict.failure;
  const bool refused = strict.diagnosis->verdict == DiagnosisVerdict::data_fault;
  EXPECT_EQ(refused, std::string(c.fault) != "disturbed");
}

INSTANTIATE_TEST_SUITE_P(One, SetAsideFault,
                         testing::Values(Case{"stuck", stick, "frozen_axis", 20.0},
                                         Case{"lost", lose, "lost_samples", 3.0}, Case{"gap", cut, "lost_samples", 5.0},
                                         Case{"spike", spike, "spike", 1.0}, Case{"burst", burst, "disturbed", 3.0},
                                         Case{"clipped_turn", clip, "saturation", 0.0},
                                         Case{"spike_in_turn", spike_in_turn, "spike", 0.0},
                                         Case{"shaken", shake, "disturbed", 7.0}),
                         [](const testing::TestParamInfo<Case>& c) { return std::string(c.param.name); });

// Every turn of one axis at the end of its range: six turns that the gyros did not see, and what they are is known from all of the recording.
// By the dwell beside it alone a heading is known to 2 mrad, whose square is 20 sigma of an accelerometer.
TEST(SetAsideWhole, EveryTurnOfAnAxis) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Recording recording = clean();
    double largest = 0.0;
    for (const auto& sample : recording.delta_theta_rad) {
      largest = std::max(largest, std::abs(sample[axis]));
    }
    for (auto& sample : recording.delta_theta_rad) {
      sample[axis] = std::clamp(sample[axis], -0.9 * largest, 0.9 * largest);
    }
    const SetAside aside(test::view_of(recording));
    ASSERT_EQ(aside.refused(), "");
    EXPECT_GE(aside.left_out().size(), 4U);
    const CalibrationOutcome outcome = calibrate(aside.data(), {});
    ASSERT_TRUE(outcome.result) << outcome.failure.message;
    const ParameterVector z =
        (outcome.result->value - test::truth_of(config(), seed)).cwiseQuotient(outcome.result->sigma);
    EXPECT_LT(z.cwiseAbs().maxCoeff(), 4.0) << axis << ": " << z.transpose();
    EXPECT_NEAR(outcome.result->consistency.nis_mean, 1.0, 0.1) << axis;
    const DiagnosisOutcome named = diagnose(aside.data(), {});
    ASSERT_TRUE(named.diagnosis) << named.failure;
    EXPECT_FALSE(named.diagnosis->mismatch) << axis;
  }
}

TEST(SetAsideWhole, NothingOfACleanRecording) {
  const ImuData data = test::view_of(clean());
  const SetAside aside(data);
  EXPECT_EQ(aside.refused(), "");
  EXPECT_TRUE(aside.left_out().empty());
  EXPECT_TRUE(aside.data().coasts.empty());
  EXPECT_EQ(aside.data().delta_v.data(), data.delta_v.data());
}

// Of 1230 s a tenth are 123; 135 are lost.
TEST(SetAsideWhole, NotMoreThanATenth) {
  Recording recording = clean();
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t first = 500 + 6500 * k;
    for (std::size_t i = first; i < first + 4500; ++i) {
      recording.delta_theta_rad[i] = recording.delta_v_mps[i] = {};
    }
  }
  const SetAside aside(test::view_of(recording));
  EXPECT_NE(aside.refused().find("of 1230 s are faulty, and by no more than a tenth"), std::string::npos)
      << aside.refused();
  EXPECT_TRUE(aside.left_out().empty());
}

// A base that sways by degrees is nowhere while the gyros are lost; without accelerometers alone it is.
TEST(SetAsideWhole, NotTheGyrosOnAMooredBase) {
  sim::SimConfig moored = config();
  moored.base_motion = test::rough_mooring();
  const Recording recording = *sim::simulate(moored, schedule(), seed, {});
  EXPECT_EQ(SetAside(test::view_of(recording)).refused(), "");
  EXPECT_TRUE(SetAside(test::view_of(recording)).left_out().empty());
  Recording stuck = recording;
  stick(stuck);
  EXPECT_NE(SetAside(test::view_of(stuck)).refused().find("the base moves"), std::string::npos);
}

// A device that gives what it gave is no sensor; nothing is estimated of it, in whatever position it is said to be.
TEST(SetAsideWhole, NoReadingsAreRefused) {
  Recording recording = clean();
  std::fill(recording.delta_theta_rad.begin(), recording.delta_theta_rad.end(), recording.delta_theta_rad.front());
  std::fill(recording.delta_v_mps.begin(), recording.delta_v_mps.end(), recording.delta_v_mps.front());
  const DiagnosisOutcome outcome = diagnose(test::view_of(recording), {}, {});
  EXPECT_FALSE(outcome.diagnosis.has_value());
  EXPECT_NE(outcome.failure.find("one value throughout"), std::string::npos) << outcome.failure;
}

// A triad in other axes is wrong all along, whatever else is.
TEST(SetAsideWhole, NotAFaultOfAllOfIt) {
  Recording recording = clean();
  for (auto& sample : recording.delta_theta_rad) {
    sample[1] = -sample[1];
  }
  lose(recording);
  EXPECT_NE(SetAside(test::view_of(recording)).refused().find("y gives -y"), std::string::npos);
}

}  // namespace
}  // namespace selfcal::diagnosis
