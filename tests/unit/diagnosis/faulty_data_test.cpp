// One fault at a time in a recording of perfect sensors with a little noise: named for what it is, with its samples; and
// nothing where there is none.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/geometry/schedule.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0;
constexpr std::size_t middle = 7000;  // 140 s: in the third dwell

struct Samples {
  earth::Position site{0.7, 2.0, 50.0};
  std::vector<double> time_s;
  std::vector<std::array<double, 3>> theta, v;
  bool gimbal = true;
};

struct Case {
  const char* name;
  std::function<void(Samples&)> spoil;
  const char* id;     // expected; empty: no fault
  const char* words;  // that the fault's own hold
  std::size_t first_sample;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class FaultyData : public testing::TestWithParam<Case> {};

TEST_P(FaultyData, IsNamed) {
  const IdealRecording ideal(*named_schedule("horizontal", 60.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 2.0, 50.0}, rate_hz);
  ImuData data = ideal.data();
  Samples samples;
  samples.time_s.assign(data.time_s.begin(), data.time_s.end());
  samples.theta.assign(data.delta_theta.begin(), data.delta_theta.end());
  samples.v.assign(data.delta_v.begin(), data.delta_v.end());
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  for (std::size_t i = 0; i < samples.v.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      samples.theta[i][axis] += 2e-8 * noise(random);
      samples.v[i][axis] += 5e-6 * noise(random);
    }
  }
  GetParam().spoil(samples);
  data.site = samples.site;
  data.time_s = samples.time_s;
  data.delta_theta = samples.theta;
  data.delta_v = samples.v;
  if (!samples.gimbal) {
    data.gimbal_outer = data.gimbal_inner = {};
  }
  const std::vector<DataFault> faults = find_data_faults(data);
  if (*GetParam().id == '\0') {
    EXPECT_TRUE(faults.empty()) << faults.front().words;
    return;
  }
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults.front().id, GetParam().id) << faults.front().words;
  EXPECT_NE(faults.front().words.find(GetParam().words), std::string::npos) << faults.front().words;
  EXPECT_EQ(faults.front().first_sample, GetParam().first_sample);
}

void swap_axes(std::vector<std::array<double, 3>>& all, std::size_t a, std::size_t b) {
  for (auto& sample : all) {
    std::swap(sample[a], sample[b]);
  }
}
void scale_axis(std::vector<std::array<double, 3>>& all, std::size_t axis, double by) {
  for (auto& sample : all) {
    sample[axis] *= by;
  }
}
void scale_all(std::vector<std::array<double, 3>>& all, double by) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scale_axis(all, axis, by);
  }
}

const Case cases[] = {
    {"nothing", [](Samples&) {}, "", "", 0},
    {"nothing_without_a_gimbal", [](Samples& s) { s.gimbal = false; }, "", "", 0},
    {"zeros", [](Samples& s) { std::fill_n(s.v.begin() + middle, 20, std::array<double, 3>{}); }, "lost_samples",
     "20 samples have zero velocity increments", middle},
    {"repeats",
     [](Samples& s) {
       std::fill_n(s.v.begin() + middle + 1, 12, s.v[middle]);
       std::fill_n(s.theta.begin() + middle + 1, 12, s.theta[middle]);
     },
     "lost_samples", "12 samples in a row repeat", middle + 1},
    {"gap", [](Samples& s) { std::for_each(s.time_s.begin() + middle, s.time_s.end(), [](double& t) { t += 0.5; }); },
     "lost_samples", "1 gaps, 25 samples missing", middle},
    {"clock", [](Samples& s) { std::for_each(s.time_s.begin(), s.time_s.end(), [](double& t) { t *= 1.01; }); },
     "time_base", "49.505 Hz", 0},
    // The Earth turns this axis by tens of the noise's counts in 4 s.
    {"frozen_gyro",
     [](Samples& s) {
       for (std::size_t i = middle; i < middle + 200; ++i) {
         s.theta[i][0] = 0.0;
       }
     },
     "frozen_axis", "gyro x gives one value for 4.0 s", middle},
    {"frozen_accelerometer",
     [](Samples& s) {
       for (std::size_t i = middle; i < middle + 150; ++i) {
         s.v[i][2] = s.v[middle][2];
       }
     },
     "frozen_axis", "accelerometer z gives one value for 3.0 s", middle},
    {"spike", [](Samples& s) { s.v[middle][1] += 0.01; }, "spike", "accelerometer y: 1 samples", middle},
    {"gyro_sign", [](Samples& s) { scale_axis(s.theta, 1, -1.0); }, "wrong_sign", "gyros: y gives -y", 0},
    {"gyro_axes", [](Samples& s) { swap_axes(s.theta, 1, 2); }, "wrong_axes", "gyros: y gives z, z gives y", 0},
    {"gyro_scale", [](Samples& s) { scale_axis(s.theta, 1, 1.1); }, "wrong_scale", "1.000, 1.100, 1.000", 0},
    {"both_axes",
     [](Samples& s) {
       swap_axes(s.theta, 0, 1);
       swap_axes(s.v, 0, 1);
     },
     "wrong_axes", "the IMU's axes: gyros and accelerometers: x gives y, y gives x", 0},
    {"accelerometer_sign", [](Samples& s) { scale_axis(s.v, 2, -1.0); }, "wrong_sign", "accelerometers: z gives -z", 0},
    {"accelerometer_axes", [](Samples& s) { swap_axes(s.v, 0, 1); }, "wrong_axes",
     "accelerometers: x gives y, y gives x", 0},
    {"accelerometer_axes_without_a_gimbal",
     [](Samples& s) {
       swap_axes(s.v, 0, 1);
       s.gimbal = false;
     },
     "wrong_axes", "accelerometers: x gives y, y gives x", 0},
    {"accelerometers_upside_down", [](Samples& s) { scale_all(s.v, -1.0); }, "wrong_sign", "upside down", 0},
    {"accelerometer_scale", [](Samples& s) { scale_all(s.v, 1.03); }, "wrong_scale", "specific force at rest is 10.09",
     0},
    // 0.7 rad is 40.107 deg.
    {"latitude", [](Samples& s) { s.site.latitude += 1.0 * units::degree; }, "wrong_site", "as at latitude 40.11 deg",
     0},
    {"hemisphere", [](Samples& s) { s.site.latitude *= -1.0; }, "wrong_site", "the site's is -40.11 deg", 0},
    // Longitude is nothing that an INS at rest can sense.
    {"longitude", [](Samples& s) { s.site.longitude += 1.0; }, "", "", 0},
};

INSTANTIATE_TEST_SUITE_P(One, FaultyData, testing::ValuesIn(cases),
                         [](const testing::TestParamInfo<Case>& c) { return std::string(c.param.name); });

}  // namespace
}  // namespace selfcal::diagnosis
