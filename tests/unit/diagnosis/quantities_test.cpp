// A bias that is there while one quantity lies in one bin is located there, with its size. Perfect sensors, and the bias in
// their increments; where it is comes from the gimbal's read-out, from the increments themselves and the clock.
#include "estimator/diagnosis/search/quantities.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/geometry/schedule.hpp"
#include "estimator/geometry/units.hpp"
#include "estimator/passes/calibration.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 50.0;
constexpr double start_c = 20.0, end_c = 25.0;  // the temperature rises evenly: its mean is 22.5

using Sample = std::array<double, 3>;

// Index of the largest component, 3 more where it is negative.
std::size_t face(const Sample& v) {
  std::size_t at = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    at = std::abs(v[k]) > std::abs(v[at]) ? k : at;
  }
  return v[at] < 0.0 ? at + 3 : at;
}

class Quantities : public testing::Test {
 protected:
  Quantities() : ideal_(*named_schedule("horizontal", 60.0, 5.0), {0.02, -0.03, 0.6}, {0.7, 0.2, 0.0}, rate_hz) {
    const ImuData& data = ideal_.data();
    theta_.assign(data.delta_theta.begin(), data.delta_theta.end());
    v_.assign(data.delta_v.begin(), data.delta_v.end());
    for (std::size_t i = 0; i < data.size(); ++i) {
      temperature_.push_back(start_c + (end_c - start_c) * static_cast<double>(i) / static_cast<double>(data.size()));
    }
  }

  // Of quantity `id`, where `axis` (0..2 gyro, 3..5 accelerometer) has a bias (SI) in the samples that `inside` picks.
  Located located(const std::string& id, std::size_t axis, double bias,
                  const std::function<bool(std::size_t)>& inside) {
    for (std::size_t i = 0; i < theta_.size(); ++i) {
      if (inside(i)) {
        (axis < 3 ? theta_ : v_)[i][axis % 3] += bias / rate_hz;
      }
    }
    ImuData data = ideal_.data();
    data.delta_theta = theta_;
    data.delta_v = v_;
    data.temperature = temperature_;
    const RecordingContext context(data);
    SignaturePass pass(context, quantity_bins(context), false);
    PassInput input;
    input.data = &data;
    input.C_nb = ideal_.C_nb_start();
    input.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
    input.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
    input.noise.observation.sigma = 1e-5;
    input.prior.parameter_sigma = 2.0 * plausible_limit();
    const Evidence evidence(pass.run(input));
    for (const Located& l : locate_by_quantity(evidence, pass.candidates(), {}, context.mean_temperature())) {
      if (l.where == id) {
        return l;
      }
    }
    return {};
  }

  // Of the recording without a bias.
  const ImuData& data() const { return ideal_.data(); }
  bool dwells(std::size_t i) const { return std::hypot(theta_[i][0], theta_[i][1], theta_[i][2]) * rate_hz < 1e-3; }

 private:
  IdealRecording ideal_;
  std::vector<Sample> theta_, v_;
  std::vector<double> temperature_;
};

// What lies at the edge of a bin, a turn's stretches of a second, is shared with the next: 3 %.
constexpr double edges = 0.03;

TEST_F(Quantities, BiasAtAnOuterAngle) {
  const Located l = located("outer_angle", 2, 0.5 * units::degree_per_hour, [&](std::size_t i) {
    return std::abs(std::remainder(data().gimbal_outer[i] - std::numbers::pi / 2.0, 2.0 * std::numbers::pi)) <
           std::numbers::pi / 8.0;
  });
  EXPECT_EQ(l.words, "gyro z, outer angle 90 deg +- 22.5");
  EXPECT_NEAR(l.size, 0.5, 0.5 * edges);
}

TEST_F(Quantities, BiasWhileAnAxisPointsUp) {
  const Located l =
      located("gravity", 1, -0.5 * units::degree_per_hour, [&](std::size_t i) { return face(data().delta_v[i]) == 3; });
  EXPECT_EQ(l.words, "gyro y, while -x is nearest to up");
  EXPECT_NEAR(l.size, -0.5, 0.5 * edges);
}

// In dwells the increments of perfect gyros are the Earth's rate; the turns between, a twelfth of the time, have no bias.
TEST_F(Quantities, BiasWhileAnAxisPointsAlongTheEarthsRate) {
  const Located l = located("earth_rate", 3, 500.0 * units::micro_g,
                            [&](std::size_t i) { return dwells(i) && face(data().delta_theta[i]) == 1; });
  EXPECT_EQ(l.words, "accelerometer x, while +y is nearest to the Earth's axis");
  EXPECT_NEAR(l.size, 500.0, 500.0 * (edges + 1.0 / 12.0));
}

TEST_F(Quantities, BiasBetweenTwoTemperatures) {
  const Located l = located("temperature", 5, 500.0 * units::micro_g, [&](std::size_t i) {
    const double share = static_cast<double>(i) / static_cast<double>(data().size());  // 22.5 to 23.5 degC
    return share >= 0.5 && share < 0.7;
  });
  EXPECT_EQ(l.words, "accelerometer z, between 22.5 and 23.5 degC");
  EXPECT_NEAR(l.size, 500.0, 500.0 * edges);
}

}  // namespace
}  // namespace selfcal::diagnosis
