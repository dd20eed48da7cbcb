// The motion model of a moored base, fitted to what the navigation would show of it.
#include "estimator/passes/motion_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

constexpr int epochs = 2900;
constexpr double swell_s = 8.9, surge_s = 14.8;  // periods
const DriftNoise sensors{5.0 * units::micro_g_per_sqrt_hz, 0.001 * units::degree_per_sqrt_hour, 3e-6};

// Of the base at the epochs 0 ... epochs, m and m/s.
struct Axis {
  std::vector<double> position = std::vector<double>(epochs + 1, 0.0);
  std::vector<double> velocity = position;
};
using Displacement = std::array<Axis, 3>;  // north, up, east

// The drift that (M1) gives for a base displaced so. Position and velocity are put back to the site every epoch, so the
// drive is minus what they drifted: with velocity v at the beginning, position by d' - d - v, velocity by v' - v.
DriftSeries drift_of(const Displacement& d, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  const double accel = sensors.accel_vrw;
  const double tilt = 9.8 * sensors.gyro_arw;
  DriftSeries series;
  Vector3 acceleration(2e-3, -1e-3, 1e-3);  // a tilt of 0.2 mrad and the like
  for (std::size_t k = 0; k < epochs; ++k) {
    Vector3 position, velocity;
    for (int axis = 0; axis < 3; ++axis) {
      // White acceleration of density accel^2 over 1 s: velocity and position correlated as 1/2 : 1/3.
      const double a = normal(engine), b = normal(engine);
      const auto& [x, v] = d[static_cast<std::size_t>(axis)];
      velocity(axis) = acceleration(axis) + accel * a - (v[k + 1] - v[k]);
      position(axis) = 0.5 * acceleration(axis) + accel * (0.5 * a + b / std::sqrt(12.0)) - (x[k + 1] - x[k] - v[k]);
      acceleration(axis) += tilt * normal(engine);
    }
    series.position.push_back(position);
    series.velocity.push_back(velocity);
    series.turning.push_back(false);
  }
  return series;
}

void add_line(Axis& axis, double amplitude, double period_s, double phase) {
  const double w = 2.0 * std::numbers::pi / period_s;
  for (std::size_t k = 0; k <= epochs; ++k) {
    axis.position[k] += amplitude * std::sin(w * static_cast<double>(k) + phase);
    axis.velocity[k] += amplitude * w * std::cos(w * static_cast<double>(k) + phase);
  }
}

// Mean square of the normalised innovations, and their largest correlation over the first ten lags.
struct Whiteness {
  double nis = 0.0, correlation = 0.0;
};

Whiteness whiteness(const DriftSeries& series, int axis, const ObservationModel& model) {
  DriftNoise noise = sensors;
  noise.white_sigma = model.sigma;
  AxisInnovations out;
  filter_axis(series, axis, noise, model.motion[static_cast<std::size_t>(axis)], out);
  const Eigen::ArrayXd w = out.value / out.variance.sqrt();
  Whiteness result{w.square().mean(), 0.0};
  for (Eigen::Index lag = 1; lag <= 10; ++lag) {
    const double r = (w.head(w.size() - lag) * w.tail(w.size() - lag)).sum() / w.square().sum();
    result.correlation = std::max(result.correlation, std::abs(r));
  }
  return result;
}

// White noise of n epochs: mean square 1 +- sqrt(2/n), correlations +- 1/sqrt(n). Four sigma.
const double nis_margin = 4.0 * std::sqrt(2.0 / epochs);
const double correlation_limit = 4.0 / std::sqrt(epochs);

void expect_white(const DriftSeries& series, const ObservationModel& model) {
  for (int axis = 0; axis < 3; ++axis) {
    const Whiteness w = whiteness(series, axis, model);
    EXPECT_NEAR(w.nis, 1.0, nis_margin) << axis;
    EXPECT_LT(w.correlation, correlation_limit) << axis;
  }
}

Oscillation strongest(const MotionModel& motion) {
  return *std::max_element(motion.oscillations.begin(), motion.oscillations.end(),
                           [](const auto& a, const auto& b) { return a.sigma < b.sigma; });
}

TEST(MotionFit, TakesLinesOutAlsoWhereTheyAreWeak) {
  Displacement d;
  add_line(d[0], 0.05, swell_s, 0.0);
  add_line(d[0], 0.001, surge_s, 1.0);  // the host heads nearly east
  add_line(d[1], 0.04, swell_s, 0.7);
  add_line(d[2], 0.08, surge_s, 1.0);
  const DriftSeries series = drift_of(d, 7);
  const ObservationModel model = fit_motion(series, sensors);
  ASSERT_FALSE(model.motion[2].oscillations.empty());
  // A displacement of amplitude A is one of A w^2 in acceleration, where the noise is white, accel_vrw per epoch: a
  // frequency in white noise is known to sqrt(24/n^3) noise/amplitude (Rife and Boorstyn 1974). Four sigma.
  const double w = 2.0 * std::numbers::pi / surge_s;
  const double bound = std::sqrt(24.0 / std::pow(epochs, 3)) * sensors.accel_vrw / (0.08 * w * w);
  EXPECT_NEAR(strongest(model.motion[2]).omega, w, 4.0 * bound);
  expect_white(series, model);
}

// Negative control: without the motion the innovations are nothing like noise.
TEST(MotionFit, WithoutItTheInnovationsShowTheSwell) {
  Displacement d;
  add_line(d[1], 0.04, swell_s, 0.7);
  ObservationModel none;
  none.sigma = sensors.white_sigma;
  const Whiteness w = whiteness(drift_of(d, 8), 1, none);
  EXPECT_GT(w.nis, 1.0 + nis_margin);
  EXPECT_GT(w.correlation, correlation_limit);
}

TEST(MotionFit, FindsNothingInTheNoiseOfTheSensors) {
  const ObservationModel model = fit_motion(drift_of({}, 9), sensors);
  EXPECT_EQ(model.state_count(), 0);
}

// A swell that forgets its phase in a minute: (M2) itself, driven. It has no velocity, so all of it goes into position.
TEST(MotionFit, FindsADampedSwell) {
  const Oscillation truth{2.0 * std::numbers::pi / swell_s, 60.0, 0.05};
  const OscillationStep step(truth, 1.0);
  Displacement d;
  std::mt19937_64 engine(10);
  std::normal_distribution<double> normal;
  for (Axis& axis : d) {
    double c = truth.sigma * normal(engine), s = truth.sigma * normal(engine);
    for (double& value : axis.position) {
      value = c;
      const double previous = c;
      c = step.cosine * c - step.sine * s + std::sqrt(step.drive_variance) * normal(engine);
      s = step.sine * previous + step.cosine * s + std::sqrt(step.drive_variance) * normal(engine);
    }
  }
  const DriftSeries series = drift_of(d, 11);
  const ObservationModel model = fit_motion(series, sensors);
  expect_white(series, model);
  // Its strongest oscillation holds the period. The width of the line is 1/decay, seen epochs/decay times in each of
  // three axes: known to width/sqrt(3 epochs/decay). Four sigma.
  ASSERT_FALSE(model.motion[0].oscillations.empty());
  EXPECT_NEAR(strongest(model.motion[0]).omega, truth.omega,
              4.0 / truth.decay_s / std::sqrt(3.0 * epochs / truth.decay_s));
}

TEST(MotionModel, KeepsItsVarianceAndKnowsWhatItCannotForesee) {
  const Oscillation o{0.7, 25.0, 0.3};
  const OscillationStep step(o, 2.0);
  // Turning and shrinking leaves exp(-2 T/decay) of the variance; the drive makes up for it.
  const double left = step.cosine * step.cosine + step.sine * step.sine;
  EXPECT_NEAR(left, std::exp(-2.0 * 2.0 / 25.0), 1e-15);
  EXPECT_NEAR(left * o.sigma * o.sigma + step.drive_variance, o.sigma * o.sigma, 1e-15);
  EXPECT_NEAR(MotionModel{{o}}.unforeseen(2.0), std::sqrt(step.drive_variance), 1e-15);
}

}  // namespace
}  // namespace selfcal
