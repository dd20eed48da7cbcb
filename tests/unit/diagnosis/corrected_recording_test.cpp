// What stays of a recording whose increments are changed.
#include "estimator/diagnosis/regression/corrected_recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "estimator/models/sensor_noise.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double angle = 4.8e-7, velocity = 1e-5;  // rad, m/s
constexpr std::size_t samples = 400;

struct Stepped {
  AngleVelocity delta_theta, delta_v;
  std::vector<double> time_s;
  ImuData data;

  Stepped() : delta_theta(samples), delta_v(samples), time_s(samples) {
    for (std::size_t k = 0; k < samples; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto steps = static_cast<double>((k * (axis + 2) + axis) % 7);
        delta_theta[k][axis] = angle * (steps - 3.0);
        delta_v[k][axis] = velocity * (steps + 1.0);
      }
      time_s[k] = 0.01 * static_cast<double>(k + 1);
    }
    data.sample_rate_hz = 100.0;
    data.time_s = time_s;
    data.delta_theta = delta_theta;
    data.delta_v = delta_v;
  }
};

// A law of 1e-9 rad a sample is no multiple of the step, but the sensor's rounding is in the increments as before.
TEST(CorrectedRecording, KeepsTheQuantaOfItsOriginal) {
  const Stepped s;
  ASSERT_NEAR(find_quanta(s.data).angle, angle, 1e-6 * angle);
  ASSERT_NEAR(find_quanta(s.data).velocity, velocity, 1e-6 * velocity);
  AngleVelocity theta = s.delta_theta, force = s.delta_v;
  for (std::size_t k = 0; k < samples; ++k) {
    theta[k][0] -= 1e-9 * std::sin(0.01 * static_cast<double>(k));
    force[k][2] -= 1e-7 * std::sin(0.01 * static_cast<double>(k));
  }
  ImuData changed = s.data;
  changed.delta_theta = theta;
  changed.delta_v = force;
  ASSERT_EQ(find_quanta(changed).angle, 0.0);  // or this shows nothing
  const CorrectedRecording once(s.data, theta, force);
  EXPECT_NEAR(find_quanta(once.data()).angle, angle, 1e-6 * angle);
  EXPECT_NEAR(find_quanta(once.data()).velocity, velocity, 1e-6 * velocity);
  const CorrectedRecording twice(once.data(), theta, force);
  EXPECT_NEAR(find_quanta(twice.data()).angle, angle, 1e-6 * angle);
}

// What stands in the place of lost samples is no observation.
TEST(CorrectedRecording, QuantaAreThoseOfObservations) {
  Stepped s;
  s.delta_theta[20] = {3.14159e-7, 2.71828e-7, 1.41421e-7};
  s.delta_v[21] = {3.14159e-6, 2.71828e-6, 1.41421e-6};
  ASSERT_EQ(find_quanta(s.data).angle, 0.0);  // or this shows nothing
  const std::vector<Coast> lost = {{.first = 5, .last = 7}, {.first = 20, .last = 22, .gyros = true}};
  s.data.coasts = lost;
  EXPECT_NEAR(find_quanta(s.data).angle, angle, 1e-6 * angle);
  EXPECT_NEAR(find_quanta(s.data).velocity, velocity, 1e-6 * velocity);
}

// Where the sensors show no step none is seen in what is left.
TEST(CorrectedRecording, HasNoQuantaWhereTheOriginalHasNone) {
  Stepped s;
  for (std::size_t k = 0; k < samples; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      s.delta_theta[k][axis] *= 1.0 + 0.1 * std::sin(static_cast<double>(k));
    }
  }
  const CorrectedRecording corrected(s.data, Stepped().delta_theta, s.delta_v);
  EXPECT_EQ(find_quanta(corrected.data()).angle, 0.0);
}

}  // namespace
}  // namespace selfcal::diagnosis
