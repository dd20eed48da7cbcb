// Gyros and accelerometers beside an attitude that is drawn here: what is answered, and what is refused with which words.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "estimator/diagnosis/poses/attitude_fit.hpp"
#include "estimator/geometry/units.hpp"
#include "tests/attitude/tracked_log.hpp"

namespace selfcal::diagnosis {
namespace {

using attitude_trial::Course;
using attitude_trial::drawn_log;
using attitude_trial::drawn_truth;
using attitude_trial::TrackedLog;
using attitude_trial::Truth;
using testing::Contains;
using testing::HasSubstr;
using testing::SizeIs;

constexpr double far = 5.0;  // sigma: one of 2 million

struct Drawn {
  Truth truth;
  TrackedLog log;
  ReferenceAttitude& attitude() { return *log.input.attitude; }
  std::vector<Eigen::Quaterniond>& q() { return attitude().readings.front().q_rm; }
  ByAttitude answer() const { return *diagnose_poses(log.input, 0.01).by_attitude; }
};

Drawn drawn(std::uint64_t seed, const Course& course = {}, double attitude_sigma = 3e-4) {
  std::mt19937_64 random(seed);
  Drawn d{drawn_truth(random), {}};
  d.truth.attitude_sigma = attitude_sigma;
  d.log = drawn_log(d.truth, course, random);
  return d;
}

double element_of(const Eigen::Matrix3d& M, const std::string& name) {
  const std::string axes = "xyz";
  const auto i = static_cast<Eigen::Index>(axes.find(name[name.find('_') + 1]));
  const auto j = name.starts_with("scale") ? i : static_cast<Eigen::Index>(axes.find(name.back()));
  return M(i, j) - (i == j ? 1.0 : 0.0);
}

void expect_right(const Drawn& d, const ByAttitude& answer) {
  ASSERT_EQ(answer.failure, "");
  ASSERT_TRUE(answer.gravity.has_value());
  ASSERT_THAT(answer.gyros, SizeIs(9));
  for (const PoseParameter& p : answer.gyros) {
    EXPECT_NEAR(p.value, element_of(d.truth.M, p.name), far * p.sigma) << p.name;
  }
  for (const PoseParameter& p : answer.gravity->parameters) {
    if (!p.name.starts_with("bias")) {
      EXPECT_NEAR(p.value, element_of(d.truth.K, p.name), far * p.sigma) << p.name;
    }
  }
  EXPECT_NEAR(answer.delay_s, d.truth.delay_s, far * answer.delay_sigma_s);
  EXPECT_NEAR(answer.drift_ppm, 1e6 * d.truth.drift, far * answer.drift_sigma_ppm);
}

TEST(Attitude, AllNineOfTheGyrosAreSeenAgainstTheAccelerometers) {
  const Drawn d = drawn(1);
  const ByAttitude answer = d.answer();
  expect_right(d, answer);
  EXPECT_EQ(answer.axes, 3);
  // 0.3 mrad and 3 s a rest: the scale factors of some 50 rad of turns an axis are known to better than 1e-4.
  EXPECT_LT(answer.gyros.front().sigma, 1e-4);
  EXPECT_NEAR(answer.noise_rad, 3e-4, 0.03 * 3e-4);
  EXPECT_NEAR(answer.gravity->lean_deg, std::acos(d.truth.up.z()) / units::degree,
              far * answer.gravity->lean_sigma_deg);
}

TEST(Attitude, WithoutNoiseWhatIsDrawnComesBack) {
  std::mt19937_64 random(2);
  Drawn d{drawn_truth(random), {}};
  d.truth.attitude_sigma = 1e-7;
  d.truth.gyro_asd = 1e-8;
  d.truth.accel_asd = 1e-7;
  Course course;
  course.rate_hz = 500.0;
  d.log = drawn_log(d.truth, course, random);
  const ByAttitude answer = d.answer();
  ASSERT_TRUE(answer.gravity.has_value());
  // What cubics through samples at 500 Hz leave of turns below 2 Hz, and the drawn motion's own steps of 1 ms, is below 1e-5.
  for (const PoseParameter& p : answer.gyros) {
    EXPECT_NEAR(p.value, element_of(d.truth.M, p.name), 1e-5) << p.name;
  }
  EXPECT_NEAR(answer.delay_s, d.truth.delay_s, 1e-5);
}

TEST(Attitude, ASignOfAllFourIsTheSameAttitude) {
  Drawn d = drawn(3);
  const ByAttitude before = d.answer();
  for (std::size_t k = 0; k < d.q().size(); k += 1 + k % 7) {
    d.q()[k].coeffs() = -d.q()[k].coeffs();
  }
  const ByAttitude after = d.answer();
  ASSERT_EQ(after.failure, "");
  EXPECT_EQ(after.left_out, 0U);
  for (std::size_t k = 0; k < before.gyros.size(); ++k) {
    EXPECT_NEAR(after.gyros[k].value, before.gyros[k].value, 1e-3 * before.gyros[k].sigma);
  }
}

TEST(Attitude, TheDataTellTheDirectionAndTheOrder) {
  Drawn d = drawn(4);
  std::vector<AttitudeReading> readings;
  for (const bool last : {false, true}) {
    for (const bool inverse : {false, true}) {
      AttitudeReading reading;
      reading.words = std::string(last ? "x y z w" : "w x y z") + (inverse ? ", inverse" : "");
      for (const Eigen::Quaterniond& true_q : d.q()) {
        // Written as x y z w of the inverse.
        const Eigen::Quaterniond q = true_q.conjugate();
        const std::array<double, 4> written{q.x(), q.y(), q.z(), q.w()};
        const Eigen::Quaterniond read = last ? Eigen::Quaterniond(written[3], written[0], written[1], written[2])
                                             : Eigen::Quaterniond(written[0], written[1], written[2], written[3]);
        reading.q_rm.push_back(inverse ? read.conjugate() : read);
      }
      readings.push_back(std::move(reading));
    }
  }
  d.attitude().readings = readings;
  const ByAttitude answer = d.answer();
  expect_right(d, answer);
  // -x -y -z w, read as w x y z, is the true attitude with other axes of r and m: (w + Pv) k, P v = (z, -y, x). No gyro tells, nor is anything
  // else that is answered. The other two readings are no attitude of these gyros.
  EXPECT_EQ(answer.reading, "w x y z");
  EXPECT_TRUE(answer.read_by_data);
  EXPECT_THAT(answer.read_as_well, testing::ElementsAre("x y z w, inverse"));
}

TEST(Attitude, TurnsAboutOneAxisLeaveSixOfNineOpen) {
  Course course;
  course.axes = Eigen::Vector3d(0.0, 0.0, 1.0);
  const Drawn d = drawn(5, course);
  const ByAttitude answer = d.answer();
  ASSERT_EQ(answer.failure, "");
  EXPECT_EQ(answer.axes, 1);
  ASSERT_THAT(answer.gains, SizeIs(1));
  EXPECT_NEAR(answer.gains.front().gain, d.truth.M.col(2).norm(), far * answer.gains.front().sigma);
  EXPECT_THAT(answer.gyros, SizeIs(0));
  EXPECT_THAT(answer.invisible, Contains(HasSubstr("6 of the 9")));
}

TEST(Attitude, WhereTrackingIsLostIsLeftOutAndCounted) {
  Drawn d = drawn(6);
  const auto n = d.q().size();
  const Eigen::Quaterniond none(NAN, NAN, NAN, NAN);
  for (std::size_t k = n / 8; k < n / 8 + 90; ++k) {
    d.q()[k] = none;  // gone
  }
  // Held for 2.5 s while the sensor turns: the third move of 4 s begins at 2 * 7 + 3 s.
  const auto held = static_cast<std::size_t>(18.0 * 60.0);
  for (std::size_t k = held; k < held + 150; ++k) {
    d.q()[k] = d.q()[held];
  }
  for (std::size_t k = n / 2; k < n; k += 500) {
    d.q()[k] = Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3::UnitX())) * d.q()[k];  // a mirrored marker
  }
  const ByAttitude answer = d.answer();
  expect_right(d, answer);
  EXPECT_EQ(answer.without, 90U);
  EXPECT_EQ(answer.held, 1);
  EXPECT_NEAR(answer.held_s, 2.5, 0.1);
  EXPECT_GE(answer.left_out, (n / 2 + 499) / 500);
  EXPECT_LE(answer.left_out, (n / 2 + 499) / 500 + 12);  // some about the gaps
}

TEST(Attitude, ATrackerThatBeginsANewFrameGoesOn) {
  Drawn d = drawn(7);
  const Eigen::Quaterniond moved(Eigen::AngleAxisd(0.05, Vector3(0.1, 0.2, 1.0).normalized()));
  for (std::size_t k = d.q().size() - 300; k < d.q().size(); ++k) {
    d.q()[k] = moved * d.q()[k];
  }
  const ByAttitude answer = d.answer();
  ASSERT_EQ(answer.failure, "");
  EXPECT_EQ(answer.pieces, 2);
  for (const PoseParameter& p : answer.gyros) {
    EXPECT_NEAR(p.value, element_of(d.truth.M, p.name), far * p.sigma) << p.name;
  }
}

// The gyros' own integral, as a filter in the device makes it, in four decimals.
void make_own(Drawn& d, double decimals) {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  d.attitude().time_s = d.log.input.time_s;
  d.attitude().in_rows_of_log = true;
  d.q().clear();
  for (const auto& g : d.log.input.gyro) {
    const Vector3 phi = (Vector3(g[0], g[1], g[2]) - d.truth.bias) * 0.01;
    q = (q * quaternion_from_rotation_vector(phi)).normalized();
    Eigen::Quaterniond written = q;
    written.coeffs() = (q.coeffs().array() * decimals).round() / decimals;
    d.q().push_back(written.normalized());
  }
}

TEST(Attitude, OneThatWasComputedFromTheseGyrosIsNoReference) {
  Drawn d = drawn(8);
  make_own(d, 1e6);
  const ByAttitude answer = d.answer();
  EXPECT_THAT(answer.failure, HasSubstr("the gyros' own noise"));
  EXPECT_TRUE(answer.independence.derived);
}

TEST(Attitude, OneThatWasNotIsNotTakenForIt) {
  // An attitude of 5 urad, which no tracker reaches: the gyros' noise of 8 urad a sample shows between them.
  const Drawn d = drawn(9, {}, 5e-6);
  const ByAttitude answer = d.answer();
  expect_right(d, answer);
  EXPECT_TRUE(answer.independence.shown);
  EXPECT_NEAR(answer.independence.value, 1.0, far * answer.independence.sigma);
}

TEST(Attitude, WhatIsNoneIsRefusedInALine) {
  Drawn still = drawn(10);
  for (Eigen::Quaterniond& q : still.q()) {
    q = Eigen::Quaterniond(Eigen::AngleAxisd(1e-4 * q.x(), Vector3::UnitX()));
  }
  EXPECT_THAT(still.answer().failure, HasSubstr("no turn"));
  Drawn late = drawn(10);
  for (double& t : late.attitude().time_s) {
    t += 1e4;
  }
  EXPECT_THAT(late.answer().failure, HasSubstr("no overlap in time"));
  Drawn other = drawn(10);
  other.q() = drawn(11).q();
  EXPECT_THAT(other.answer().failure, HasSubstr("the gyros follow"));
  Drawn none = drawn(10);
  for (Eigen::Quaterniond& q : none.q()) {
    q.coeffs().setConstant(NAN);
  }
  EXPECT_THAT(none.answer().failure, HasSubstr("no row of it"));
}

// Rows of the log hold the latest value of a slower tracker: the stamps between the rows come back.
TEST(Attitude, ValuesThatAreHeldInAFasterLogKeepTheirClock) {
  Course course;
  course.rate_hz = 200.0;
  course.attitude_hz = 117.0;
  std::mt19937_64 random(12);
  Drawn d{drawn_truth(random), {}};
  d.truth.drift = 0.0;
  d.log = drawn_log(d.truth, course, random);
  const ReferenceAttitude samples = d.attitude();
  ReferenceAttitude rows;
  rows.in_rows_of_log = true;
  rows.readings.resize(1);
  std::size_t k = 0;
  for (const double t : d.log.input.time_s) {
    while (k + 1 < samples.time_s.size() && samples.time_s[k + 1] <= t) {
      ++k;
    }
    rows.time_s.push_back(t);
    rows.readings[0].q_rm.push_back(samples.readings[0].q_rm[k]);
  }
  d.attitude() = rows;
  d.truth.delay_s += 0.0025;  // half a row, on average
  const ByAttitude answer = d.answer();
  expect_right(d, answer);
  EXPECT_NEAR(answer.interval_s, 1.0 / 117.0, 1e-5);
  EXPECT_NEAR(answer.noise_rad, 3e-4, 0.1 * 3e-4);  // no jitter of a row, which at 1 rad/s is ten times as much
}

// Every derivative of the rows against differences.
TEST(AttitudeRows, DerivativesAreThoseOfTheRows) {
  Course course;
  course.stops = 2;
  const Drawn d = drawn(13, course);
  const ReferenceAttitude& attitude = *d.log.input.attitude;
  const GyroTrack track = track_of(d.log.input);
  const Knots knots = find_knots(attitude);
  AttitudeModel model;  // a little off, so that rows are small
  model.W = 1.01 * (d.truth.M * d.truth.C_bm.toRotationMatrix()).inverse();
  model.bias = d.truth.bias;
  model.walk = Eigen::MatrixXd::Zero(3, 3);
  model.node_s = 10.0;
  model.middle_s = 8.0;
  std::vector<Eigen::Quaterniond> q;
  for (const Knot& knot : knots.all) {
    q.push_back(attitude.readings.front().q_rm[knot.sample]);
  }
  const auto rows = integrate(track, knots, q, model);
  const auto more = [&](const AttitudeModel& at, std::size_t k) { return integrate(track, knots, q, at)[k].more; };
  constexpr double step = 1e-6;
  for (std::size_t k = 40; k < rows.size(); k += 97) {
    for (Eigen::Index c = 0; c < 9; ++c) {
      AttitudeModel up = model, down = model;
      up.W(c % 3, c / 3) += step;
      down.W(c % 3, c / 3) -= step;
      // `more` falls by what the gyros turn further; what is left out is of the order of the turn in the row, 0.02.
      const Vector3 by = (more(down, k) - more(up, k)) / (2.0 * step);
      EXPECT_LT((by - rows[k].by_W.col(c)).norm(), 1e-3 * (1e-3 + by.norm())) << k << " " << c;
    }
    for (Eigen::Index c = 0; c < 3; ++c) {
      AttitudeModel up = model, down = model;
      up.bias(c) += step;
      down.bias(c) -= step;
      EXPECT_LT(((more(down, k) - more(up, k)) / (2.0 * step) - rows[k].by_bias.col(c)).norm(), 5e-5);
    }
    AttitudeModel up = model, down = model;
    up.delay_s += step;
    down.delay_s -= step;
    EXPECT_LT(((more(down, k) - more(up, k)) / (2.0 * step) - (rows[k].rate_before - rows[k].rate)).norm(), 0.02);
  }
}

// Innovations of what the filter assumes are white and of the stated variance; those of another noise are not.
TEST(AttitudeNoise, InnovationsAreWhite) {
  std::mt19937_64 random(14);
  std::normal_distribution<double> normal;
  AttitudeNoise noise;
  noise.interval_s = 0.01;
  noise.walk_psd = 1e-8;
  noise.variance = 1e-7;
  noise.keeps = 0.8;
  std::vector<AttitudeRow> rows(20000);
  Vector3 error = Vector3::Zero();
  const auto draw = [&] { return Vector3(normal(random), normal(random), normal(random)); };
  error = std::sqrt(noise.variance) * draw();
  Vector3 level = Vector3::Zero(), last = error;
  for (AttitudeRow& row : rows) {
    row.length_s = noise.interval_s;
    level += std::sqrt(noise.walk_psd * noise.interval_s) * draw();
    error = noise.keeps * error + std::sqrt(noise.variance * (1.0 - noise.keeps * noise.keeps)) * draw();
    row.more = level + error - last;
    last = level + error;
  }
  rows.front().begins = true;
  const Used used(rows.size(), true);
  const auto figures = [&](const AttitudeNoise& assumed) {
    const Innovations all = innovations_of(rows, used, assumed);
    double square = 0.0, neighbours = 0.0;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      square += all.value[k].squaredNorm() / all.variance[k] / 3.0;
      neighbours += all.value[k].dot(all.value[k - 1]) / all.variance[k] / 3.0;
    }
    return std::pair(square / 20000.0, neighbours / 20000.0);
  };
  const auto [square, neighbours] = figures(noise);
  // 60000 values: sigma of the mean square 0.006, of the correlation 0.004.
  EXPECT_NEAR(square, 1.0, 0.025);
  EXPECT_NEAR(neighbours, 0.0, 0.017);
  AttitudeNoise white = noise;
  white.keeps = 0.0;
  EXPECT_GT(std::abs(figures(white).second), 0.1);
  const AttitudeNoise found = fit_noise(rows, used, noise.interval_s);
  EXPECT_EQ(found.keeps, 0.8);
  EXPECT_NEAR(found.variance / noise.variance, 1.0, 0.1);
}

}  // namespace
}  // namespace selfcal::diagnosis
