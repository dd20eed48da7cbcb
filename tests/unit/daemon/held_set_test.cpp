// What becomes of a set in an INS that cannot hold all of it: it is told, and refused beyond the tolerance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "daemon/ins/ins_client.hpp"
#include "daemon/run/ins_checks.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tests/unit/daemon/fake_ins.hpp"
#include "tests/unit/daemon/simulated_timers.hpp"

namespace selfcal {
namespace {

using testing::HasSubstr;
using Set = std::array<double, sensor_parameter_count>;

Set in_every_unit(double value) {
  Set set;
  set.fill(value);
  return set;
}

// The paper's accelerometer x, 162 and -151 ppm, in an INS with one factor: 156.5 for both signs, 5.5 ug lost at 1 g.
class OneFactor : public testing::Test {
 protected:
  void SetUp() override {
    wanted_[parameter::accel_scale_pos] = 162e-6;
    wanted_[parameter::accel_scale_neg] = -151e-6;
    held_[parameter::accel_scale_pos] = 156.5e-6;
    held_[parameter::accel_scale_neg] = -156.5e-6;
  }
  Set wanted_{}, held_{};
};

TEST_F(OneFactor, IsToldWithWhatIsLost) {
  EXPECT_FALSE(check_held(wanted_, held_, in_every_unit(10.0)));
  EXPECT_EQ(words_of_loss(wanted_, held_, in_every_unit(10.0)),
            "accel_scale_pos_x: 162 ppm were found, the INS holds 156.5: 5.5 ug are lost at 1 g, "
            "9.27 m after 10 minutes of navigation");  // 5.5e-6 R (1 - cos(0.7444)), R = 6371 km
}

TEST_F(OneFactor, IsRefusedBeyondTheTolerance) {
  const Complaint complaint = check_held(wanted_, held_, in_every_unit(5.0));
  ASSERT_TRUE(complaint);
  EXPECT_THAT(*complaint, HasSubstr("10 minutes of navigation, and 5 ppm are tolerated: nothing is written"));
}

TEST_F(OneFactor, IsHeldAgainstEachParametersOwnTolerance) {
  held_ = wanted_;
  held_[parameter::gyro_drift + 1] += 0.02 * sensor_parameters[parameter::gyro_drift + 1].si_per_unit;
  Set tolerance = in_every_unit(10.0);
  EXPECT_FALSE(check_held(wanted_, held_, tolerance));
  tolerance[parameter::gyro_drift + 1] = 0.01;
  EXPECT_THAT(check_held(wanted_, held_, tolerance).value_or(""), HasSubstr("gyro_drift_y"));
}

TEST(HeldSet, NothingIsSaidOfRounding) {
  Set wanted = in_every_unit(1e-5), held = wanted;
  held[7] *= 1.0 + 1e-12;
  EXPECT_EQ(words_of_loss(wanted, held, in_every_unit(1.0)), "");
}

// In other units a conversion there and back moves the last bit: what is written must be what is read back.
TEST(HeldSet, SettlesWhereTheInsHasOtherUnits) {
  testing_support::SimulatedTimers timers;
  testing_support::FakeIns port(timers);
  const auto example = profile::load_profile(SELFCAL_SOURCE_DIR "/config/profiles/example.toml");
  ASSERT_TRUE(example) << example.error().message;
  const InsClient client(timers, port, *example);
  ins::Coefficients set;
  set.version = 3;
  int moved = 0;
  for (int round = 0; round < 200; ++round) {
    for (std::size_t k = 0; k < set.value.size(); ++k) {
      set.value[k] = 1e-4 * std::sin(1.0 + round + 0.37 * static_cast<double>(k));
    }
    const auto held = client.as_held(set);
    ASSERT_TRUE(held) << held.error().message;
    const auto decoded = ins::decode_coefficients(*held);
    ASSERT_TRUE(decoded);
    moved += *decoded == set ? 0 : 1;
    EXPECT_EQ(client.as_held(*decoded).value(), *held);
  }
  EXPECT_GT(moved, 0);  // else this shows nothing
}

}  // namespace
}  // namespace selfcal
