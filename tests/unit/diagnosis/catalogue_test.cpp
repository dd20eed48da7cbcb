// What the catalogue says of its effects, and which of two variants a recording is asked about.
#include "estimator/diagnosis/effects/catalogue.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/diagnosis/isolability.hpp"
#include "estimator/diagnosis/search/judgement.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

const Effect& effect_of(const std::string& id, TemperatureUse temperature = TemperatureUse::none) {
  for (const Effect& e : catalogue()) {
    if (e.id == id && e.temperature == temperature) {
      return e;
    }
  }
  ADD_FAILURE() << id;
  return catalogue().front();
}

TEST(Catalogue, EveryRowIsWhole) {
  std::set<int> places;
  for (const Effect& e : catalogue()) {
    EXPECT_TRUE(places.insert(e.place).second) << e.id << " shares its place";
    EXPECT_FALSE(e.id.empty() || e.equation.empty() || e.excited.empty() || e.experiment.empty()) << e.id;
    EXPECT_FALSE(e.parameters.empty()) << e.id;
    EXPECT_NE(e.sensor == nullptr, e.displacement == nullptr) << e.id;
    using Kind = EffectConstant::Kind;
    EXPECT_EQ(e.constant.kind == Kind::none, e.constant.name.empty()) << e.id;
    EXPECT_EQ(e.constant.kind == Kind::grid, !e.constant.grid.empty()) << e.id;
    for (const EffectParameter& p : e.parameters) {
      EXPECT_GT(p.typical, 0.0) << e.id << " " << p.name;
    }
  }
}

// An id stands for one effect, or for its two variants: with a temperature channel and without. A recording is asked about
// each id once.
TEST(Catalogue, OneVariantOfEveryIdApplies) {
  for (const bool channel : {false, true}) {
    std::map<std::string, int> asked;
    for (const Effect& e : catalogue()) {
      asked[e.id] += applies(e, channel) ? 1 : 0;
    }
    for (const auto& [id, times] : asked) {
      EXPECT_EQ(times, 1) << id << (channel ? " with a channel" : " without");
    }
  }
}

// A suspect is what was asked about: with a channel neither the warm-up's equation nor the advice to fit a channel.
TEST(Catalogue, ASuspectHasItsOwnEquationAndAdvice) {
  const Effect& measured = effect_of("gyro_temperature", TemperatureUse::measured);
  const Finding f = describe(Suspect{&measured, -3.0, 1.0});
  EXPECT_EQ(f.source, &measured);
  EXPECT_EQ(f.equation, "dw_i = b_i (T - mean T)");
  EXPECT_EQ(f.experiment, "heating the block");
}

// A temperature that swings five times: its columns have nearly nothing of a ramp (the sine of whole periods leaves
// 6/(5 pi)^2 = 2.4 % of its square in it), a warm-up of two hours nearly all. Against the measured temperature a ramp of
// 100 ug/h stands far off; against the warm-up, which no recording with a channel is asked about, it would not.
TEST(Isolability, TheRivalIsTheVariantThatTheRecordingWasAskedAbout) {
  Schedule schedule;
  schedule.rotation_s = 20.0;
  for (int k = 0; k < 8; ++k) {
    schedule.positions.push_back({k % 2 == 0 ? 0.0 : 90.0, 90.0 * (k / 2)});
    schedule.dwell_s.push_back(60.0);
  }
  const IdealRecording ideal(schedule, {}, {0.8, 0.0, 0.0}, 20.0);
  ImuData data = ideal.data();
  std::vector<double> temperature;
  const double span = data.time_s.back();
  for (const double t : data.time_s) {
    temperature.push_back(20.0 + std::sin(2.0 * M_PI * 5.0 * t / span));
  }
  data.temperature = temperature;
  Diagnosis d;
  d.calibration.value.setZero();
  d.calibration.linearised_value.setZero();
  d.calibration.C_nb_start = d.calibration.linearised_C_nb = ideal.C_nb_start();
  d.calibration.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
  d.calibration.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
  d.calibration.noise.observation.sigma = 3e-6;
  const Effect& ramp = effect_of("accel_bias_ramp");
  Finding f;
  f.source = &ramp;
  f.rivals = {&effect_of("accel_temperature", TemperatureUse::measured)};
  d.findings = {f};
  d.model = {{&ramp, NAN, Eigen::Vector3d(5.0, 0.0, 0.0), {}}};
  const auto of_warm_up = [&] {
    d.findings.front().rivals = {&effect_of("accel_temperature", TemperatureUse::warm_up)};
    return plan_splits(d, data, schedule).front().separation_now;
  };
  const std::vector<Split> splits = plan_splits(d, data, schedule);
  ASSERT_EQ(splits.size(), 1U);
  EXPECT_GT(splits.front().separation_now, 10.0 * of_warm_up());
  for (const Experiment& e : splits.front().experiments) {
    EXPECT_TRUE(std::isfinite(e.separation)) << e.id;
  }
}

}  // namespace
}  // namespace selfcal::diagnosis
