#include "daemon/estimate/coefficient_set.hpp"

#include <gmock/gmock.h>

#include "estimator/geometry/units.hpp"

namespace selfcal {
namespace {

using ::testing::HasSubstr;

CoefficientSet sample() {
  CoefficientSet set;
  set.serial = "SN \"7\"";
  set.computed_at_utc = "2024-02-03T04:05:06Z";
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    set.value[k] = (static_cast<double>(k) - 11.3) * sensor_parameters[k].si_per_unit;
    set.sigma[k] = 0.25 * sensor_parameters[k].si_per_unit;
    set.determined[k] = k != 16;
  }
  return set;
}

void replace(std::string& text, const std::string& from, const std::string& to) {
  ASSERT_NE(text.find(from), std::string::npos) << from;
  text.replace(text.find(from), from.size(), to);
}

TEST(CoefficientSetJson, ReadsBack) {
  const CoefficientSet set = sample();
  const auto read = parse_coefficient_set(coefficient_set_json(set), "set.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->serial, set.serial);
  EXPECT_EQ(read->computed_at_utc, set.computed_at_utc);
  EXPECT_EQ(read->determined, set.determined);
  EXPECT_EQ(read->acceptable, set.acceptable);
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    // Into the unit and back: two roundings.
    EXPECT_DOUBLE_EQ(read->value[k], set.value[k]);
    EXPECT_DOUBLE_EQ(read->sigma[k], set.sigma[k]);
  }
}

TEST(CoefficientSetJson, FaultsAreNamed) {
  const auto error_of = [](const std::string& from, const std::string& to) {
    std::string text = coefficient_set_json(sample());
    replace(text, from, to);
    const auto read = parse_coefficient_set(text, "set.json");
    return read ? std::string("no error") : read.error().message;
  };
  EXPECT_THAT(error_of("\"ug\"", "\"mg\""), HasSubstr("parameters[0]: name accel_bias_x, unit ug expected"));
  EXPECT_THAT(error_of("gyro_scale_y", "gyro_scale_q"), HasSubstr("parameters[16]"));
  EXPECT_THAT(error_of("\"value\":", "\"valve\":"), HasSubstr("value: not a finite number"));
  EXPECT_THAT(error_of("\"determined\":false", "\"determined\":0"), HasSubstr("parameters[16]: determined"));
  EXPECT_THAT(error_of("\"serial\":", "\"cereal\":"), HasSubstr("serial: not a string"));
  EXPECT_THAT(error_of("}]", "}"), HasSubstr("not a JSON object"));
}

// What the recording did not determine must never reach an INS: the value in force stays.
TEST(MergedWithInForce, KeepsWhatWasNotDetermined) {
  const CoefficientSet set = sample();
  std::array<double, sensor_parameter_count> in_force{};
  in_force.fill(42.0);
  const auto merged = merged_with_in_force(set, in_force);
  for (std::size_t k = 0; k < sensor_parameter_count; ++k) {
    EXPECT_EQ(merged[k], k == 16 ? 42.0 : set.value[k]);
  }
}

}  // namespace
}  // namespace selfcal
