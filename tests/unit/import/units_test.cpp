// Which unit fits the size of gravity and a turn, and what is ambiguous.
#include <gmock/gmock.h>

#include <tuple>

#include "protocol/import/guess_names.hpp"
#include "protocol/import/guess_time.hpp"
#include "protocol/import/guess_units.hpp"

namespace selfcal::import {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(Units, GravityTellsTheUnitWhereOneFits) {
  const auto fit = accelerometer_unit(9.81, 0.01, {});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->unit, "m/s^2");
  EXPECT_THAT(fit->rivals, IsEmpty());  // mg*s is 2 % off, and nobody's habit
  const auto increments = accelerometer_unit(0.0981, 0.01, {});
  ASSERT_TRUE(increments);
  EXPECT_EQ(increments->unit, "m/s");
  EXPECT_TRUE(increments->increments);
}

// At 10 Hz an increment of gravity is 0.981 m/s: a g of a sensor that is 2 % off.
TEST(Units, WhatFitsTwiceIsTold) {
  const auto fit = accelerometer_unit(0.981, 0.1, {});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->unit, "g");
  EXPECT_THAT(fit->rivals, ElementsAre("m/s (increments)"));
  const auto named = accelerometer_unit(0.981, 0.1, {"g", false});
  ASSERT_TRUE(named);
  EXPECT_EQ(named->unit, "g");
  EXPECT_THAT(named->rivals, IsEmpty());
  // A count of 1.0 mg*s at 100 Hz is nearer to mg*s than to m/s^2.
  const auto rare = accelerometer_unit(10.0, 0.01, {});
  ASSERT_TRUE(rare);
  EXPECT_THAT(rare->rivals, ElementsAre("mg*s (increments)"));
}

TEST(Units, ANameThatGravityContradictsIsNoUnit) {
  EXPECT_FALSE(accelerometer_unit(9.81, 0.01, {"g", false}));
  EXPECT_FALSE(accelerometer_unit(4096.0, 0.01, {}));  // counts
  EXPECT_FALSE(gyro_unit(0.01, 0.01, {"deg/s", false}));
}

TEST(Units, AUnitSaysWhatANameOfAnotherLanguageIs) {
  const auto role = [](const char* name) { return read_name(name, "").role; };
  EXPECT_EQ(role("Temps (s)"), Role::time);
  EXPECT_EQ(role("Température (°C)"), Role::temperature);
  EXPECT_EQ(role("Vitesse angulaire X (°/s)"), Role::gyro);
  EXPECT_EQ(role("Ускорение x (m/s²)"), Role::accelerometer);
  EXPECT_EQ(role("mag_x [mG]"), Role::other);
  EXPECT_EQ(role("GRAVITY X (m/s²)"), Role::other);
  EXPECT_EQ(role("DATA_CNT"), Role::counter);
  EXPECT_EQ(role("ts"), Role::time);
  EXPECT_EQ(read_name("omega_x_rpm", "").unit, "rpm");
  EXPECT_EQ(read_name("wz [rev/s]", "").unit, "rev/s");
}

// At 10 Hz a g is an increment of 0.98 m/s too.
TEST(Units, RatesBeforeIncrementsThatNobodySays) {
  const auto fit = accelerometer_unit(0.966, 1.0 / 9.9, {});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->unit, "g");
  EXPECT_THAT(fit->rivals, ElementsAre("m/s (increments)"));
  EXPECT_EQ(accelerometer_unit(0.966, 1.0 / 9.9, {"", true})->unit, "m/s");
}

TEST(Units, TurnsTellRatesFromIncrements) {
  // 0.01 rad a count and sample at 100 Hz: rad/s. 57 Hz: rad/s and degrees are the same to a per cent.
  EXPECT_EQ(gyro_unit(0.01, 0.01, {}).value().unit, "rad/s");
  EXPECT_EQ(gyro_unit(0.0174533, 0.01, {}).value().unit, "deg");
  EXPECT_EQ(gyro_unit(0.0174533, 1.0 / 57.0, {}).value().unit, "rad/s");
  EXPECT_THAT(gyro_unit(0.0174533, 1.0 / 57.0, {}).value().rivals, ElementsAre("deg (increments)"));
  EXPECT_EQ(gyro_unit(4.848e-8, 0.01, {}).value().unit, "deg/h");
}

// 29.3 degC in a register of 0.1 degC a count, and 20 degC in K.
TEST(Units, WholeNumbersOfATemperatureMayBeCounts) {
  EXPECT_TRUE(temperature_unit(293.0, {}, true, false).doubt);
  EXPECT_FALSE(temperature_unit(293.1, {}, false, false).doubt);
  EXPECT_EQ(temperature_unit(293.1, {}, false, false).unit, "K");
  EXPECT_FALSE(temperature_unit(293.0, "K", true, false).doubt);
  EXPECT_TRUE(temperature_unit(31.0, {}, true, true).doubt);
}

TEST(Units, TimesThatMakeASampleRate) {
  EXPECT_THAT(time_units(0.01), ElementsAre("s"));
  EXPECT_THAT(time_units(10000), ElementsAre("us"));
  EXPECT_THAT(time_units(0.1), ElementsAre("s", "ms"));  // 10 Hz or 10 kHz
  EXPECT_THAT(time_units(1e12), IsEmpty());
}

TEST(Units, TimesOfAWholeLog) {
  const auto stamps = [](long double first, long double interval, int rows) {
    std::vector<long double> all;
    for (int k = 0; k < rows; ++k) {
      all.push_back(first + interval * static_cast<long double>(k));
    }
    return all;
  };
  EXPECT_THAT(time_units_of(stamps(1582107260391.0L, 50.0L, 100000), 50.0), ElementsAre("ms"));  // since 1970
  EXPECT_THAT(time_units_of(stamps(1582107260391000.0L, 500.0L, 100000), 500.0), ElementsAre("us"));
  EXPECT_THAT(time_units_of(stamps(0.0L, 0.1L, 500), 0.1), ElementsAre("s"));  // over within 50 ms otherwise
  EXPECT_THAT(time_units_of(stamps(0.0L, 0.1L, 100000), 0.1), ElementsAre("s", "ms"));
  EXPECT_EQ(time_units_of(stamps(0.0L, 1.0L, 500), 1.0).size(), 2U);  // a counter that is called a time
}

// A clock of the computer that wrote the rows down stands behind the sensor's.
TEST(Times, TwoClocksAreHeldAgainstEachOther) {
  EXPECT_LT(remoteness_of_clock("field.header.stamp"), remoteness_of_clock("%time"));
  EXPECT_LT(remoteness_of_clock("time"), remoteness_of_clock("server_time"));
  std::vector<long double> stamps;
  std::vector<double> alike, slower;
  for (int k = 0; k < 100; ++k) {
    stamps.push_back(static_cast<long double>(k));
    alike.push_back(1e6 + 1e3 * (k + 0.1 * (k % 3)));
    slower.push_back(560.0 * k);
  }
  EXPECT_FALSE(other_rate(stamps, 0.0, alike, 0.0));
  EXPECT_FALSE(other_rate(stamps, 1.0, alike, 1e-3));
  EXPECT_NEAR(other_rate(stamps, 1.0, slower, 1e-3).value(), 0.56, 1e-9);
  EXPECT_NEAR(other_rate(stamps, 0.0, slower, 0.0).value(), 0.56, 1e-9);
}

TEST(Times, TheRateThatAHeadSays) {
  EXPECT_EQ(rate_in_head("// Start Time: Unknown\n// Sample rate: 100.0Hz\n"), "100.0");
  EXPECT_EQ(rate_in_head("# Config: data_rate = 2000 Hz, filter = 488 Hz\n"), "2000");
  EXPECT_EQ(rate_in_head("OutputRate:,60Hz\nsampling rate 120 Hz\n"), "");
  EXPECT_EQ(rate_in_head("# filter 42 Hz\n"), "");
}

// "accel_g_x" was a gyro for its g.
TEST(Names, AUnitBeforeTheAxis) {
  for (const auto& [name, role, unit] : {std::tuple{"accel_g_x", Role::accelerometer, "g"},
                                         {"acc_mg_y", Role::accelerometer, "mg"},
                                         {"accel_ms2_z", Role::accelerometer, "m/s^2"},
                                         {"gyro_dps_x", Role::gyro, "deg/s"},
                                         {"gyro_rad_s_y", Role::gyro, "rad/s"},
                                         {"accel_ms_x", Role::accelerometer, ""}}) {
    const NamedColumn column = read_name(name, "");
    EXPECT_EQ(column.role, role) << name;
    EXPECT_EQ(column.unit, unit) << name;
    EXPECT_FALSE(column.increment) << name;
  }
}

TEST(Names, DirectionsAreARightHandedTriad) {
  const auto axes = [](const std::vector<std::string>& names) {
    std::vector<int> all;
    for (const NamedColumn& c : read_names(names, {})) {
      all.push_back(c.role == Role::accelerometer ? c.axis : -1);
    }
    return all;
  };
  EXPECT_EQ(axes({"acc_fwd", "acc_left", "acc_up"}), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(axes({"Acc Forward (g)", "Acc Right (g)", "Acc Down (g)"}), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(axes({"acc_up_g", "acc_right_g", "acc_fwd_g"}), (std::vector<int>{2, 0, 1}));  // right, forward, up
  EXPECT_EQ(axes({"LongAccel", "LatAccel", "VertAccel"}), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(axes({"lat", "long", "alt", "vert_acc"}), (std::vector<int>{-1, -1, -1, -1}));
}

TEST(Names, UnitsInFull) {
  EXPECT_EQ(known_unit("radians/s"), "rad/s");
  EXPECT_EQ(known_unit("degrees per second"), "deg/s");
  EXPECT_EQ(known_unit("meters/second^2"), "m/s^2");
  EXPECT_EQ(known_unit("metres per second squared"), "m/s^2");
  EXPECT_EQ(known_unit("microteslas"), "");
}

TEST(Names, WhatATimeCounts) {
  EXPECT_EQ(read_name("Time [min]", "").unit, "min");
  EXPECT_EQ(read_name("time_hrs", "").unit, "h");
  EXPECT_EQ(read_name("Time [ticks]", "").other_unit, "ticks");
  EXPECT_EQ(read_name("Time (0.1 ms)", "").other_unit, "0.1 ms");
  EXPECT_EQ(read_name("Time (UTC)", "").other_unit, "");
  EXPECT_EQ(read_name("Acc X [in/s^2]", "").other_unit, "in/s^2");
  EXPECT_EQ(read_name("Acc X [mGal]", "").unit, "mGal");
}

}  // namespace
}  // namespace selfcal::import
