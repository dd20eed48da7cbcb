// An INS that holds what it corrects with, and scale factors with their nominal value. The reference is the sensors' equation
// (tools/handbook/frames-and-signs.md) and the INS's own, which undo each other.
#include "protocol/profile/set_form.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>

#include "protocol/profile/describe.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "tests/unit/protocol/profile_text.hpp"

namespace selfcal::profile {
namespace {

using Triple = std::array<double, 3>;
using Square = std::array<Triple, 3>;

double drawn(double most) { return most * ((*rc::gen::inRange(-1'000'003, 1'000'004)) / 1'000'003.0); }

// Order of the 24: bias xyz, drift xyz, K+ xyz, K- xyz, A yx zx zy, K_G xyz, G xy xz yx yz zx zy.
constexpr std::size_t bias = 0, drift = 3, plus = 6, minus = 9, angles = 12, gyro_scale = 15, gyro_angles = 18;

SetValues drawn_errors(double asymmetry) {
  SetValues e;
  for (std::size_t k = 0; k < 3; ++k) {
    e[bias + k] = drawn(0.05);
    e[drift + k] = drawn(1e-4);
    e[plus + k] = drawn(5e-3);
    e[minus + k] = -e[plus + k] + drawn(asymmetry);
    e[angles + k] = drawn(5e-3);
    e[gyro_scale + k] = drawn(5e-3);
  }
  for (std::size_t k = 0; k < 6; ++k) {
    e[gyro_angles + k] = drawn(5e-3);
  }
  return e;
}

// K+ max(v, 0) + K- max(-v, 0) + A v
Triple accel_terms(const SetValues& s, const Triple& v) {
  Triple t;
  for (std::size_t k = 0; k < 3; ++k) {
    t[k] = s[plus + k] * std::max(v[k], 0.0) + s[minus + k] * std::max(-v[k], 0.0);
  }
  t[1] += s[angles] * v[0];
  t[2] += s[angles + 1] * v[0] + s[angles + 2] * v[1];
  return t;
}

Triple gyro_terms(const SetValues& s, const Triple& v) {
  const Square g{{{s[gyro_scale], s[gyro_angles], s[gyro_angles + 1]},
                  {s[gyro_angles + 2], s[gyro_scale + 1], s[gyro_angles + 3]},
                  {s[gyro_angles + 4], s[gyro_angles + 5], s[gyro_scale + 2]}}};
  Triple t{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      t[row] += g[row][column] * v[column];
    }
  }
  return t;
}

Triple plus_times(Triple a, double factor, const SetValues& s, std::size_t first) {
  for (std::size_t k = 0; k < 3; ++k) {
    a[k] += factor * s[first + k];
  }
  return a;
}

Triple sum(Triple a, const Triple& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    a[k] += b[k];
  }
  return a;
}

double largest_difference(const Triple& a, const Triple& b) {
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    largest = std::max(largest, std::abs(a[k] - b[k]));
  }
  return largest;
}

// What the INS takes for the truth when its sensors say so.
template <typename Terms>
Triple corrected(SetForm form, const SetValues& held, const Triple& told, std::size_t first, Terms terms) {
  if (form == SetForm::correction) {
    const Triple u = plus_times(told, -1.0, held, first);
    return sum(u, terms(held, u));
  }
  return plus_times(sum(told, terms(held, told)), -1.0, held, first);
}

void corrects(SetForm form, double asymmetry) {
  constexpr double most_f = 20.0, most_angle = 5e-3, most_bias = 0.05;
  const SetValues errors = drawn_errors(asymmetry);
  const Triple f{drawn(most_f), drawn(most_f), drawn(most_f)}, w{drawn(3), drawn(3), drawn(3)};
  const Triple fs = plus_times(sum(f, accel_terms(errors, f)), 1.0, errors, bias);
  const Triple ws = plus_times(sum(w, gyro_terms(errors, w)), 1.0, errors, drift);
  const auto held = converted(form, errors);
  RC_ASSERT(held.has_value());
  // Two elements of A in a row; a sign of f that the bias turns round costs a slope's difference on the bias.
  const double left = asymmetry * (most_angle * most_f + 2 * most_bias) * 1.1 + 1e-14;
  RC_ASSERT(largest_difference(corrected(form, *held, fs, bias, accel_terms), f) <= left);
  RC_ASSERT(largest_difference(corrected(form, *held, ws, drift, gyro_terms), w) <= 1e-15);
  const auto again = converted(form, *held);
  RC_ASSERT(again.has_value());
  for (std::size_t k = 0; k < errors.size(); ++k) {
    RC_ASSERT(std::abs((*again)[k] - errors[k]) <= 1e-17);
  }
}

RC_GTEST_PROP(SetForm, TheCorrectionUndoesTheErrors, ()) { corrects(SetForm::correction, 0.0); }
RC_GTEST_PROP(SetForm, TheCorrectionBeforeTheBiasUndoesTheErrors, ()) { corrects(SetForm::correction_first, 0.0); }
RC_GTEST_PROP(SetForm, SlopesThatDifferLeaveTheirProductWithAnAngle, ()) {
  corrects(SetForm::correction, 4e-4);
  corrects(SetForm::correction_first, 4e-4);
}

// To first order a correction is the error with the other sign; here it would be wrong by 25 ppm, the square of 5000.
TEST(SetForm, IsNotTheErrorWithTheOtherSign) {
  SetValues errors{};
  errors[gyro_scale] = 5e-3;
  errors[plus] = 5e-3;
  errors[minus] = -5e-3;
  const SetValues held = converted(SetForm::correction, errors).value();
  EXPECT_NEAR(held[gyro_scale], -5e-3 / 1.005, 1e-18);
  EXPECT_NEAR(held[plus], -5e-3 / 1.005, 1e-18);
  EXPECT_NEAR(held[minus], 5e-3 / 1.005, 1e-18);
  EXPECT_NEAR(held[gyro_scale] + 5e-3, 25e-6, 0.2e-6);
  EXPECT_EQ(converted(SetForm::errors, errors).value(), errors);
}

TEST(SetForm, WhatHasNoInverseIsNamed) {
  SetValues held{};
  held[plus + 1] = -1.0;
  EXPECT_THAT(converted(SetForm::correction, held).error().message, testing::HasSubstr("accel_scale_pos_y is -1"));
  held = {};
  held[minus + 2] = 1.5;
  EXPECT_THAT(converted(SetForm::correction, held).error().message, testing::HasSubstr("accel_scale_neg_z is 1.5"));
  held = {};
  held[gyro_angles] = held[gyro_angles + 2] = 1.0;  // xy and yx: two rows alike
  EXPECT_THAT(converted(SetForm::correction, held).error().message, testing::HasSubstr("has no inverse"));
  EXPECT_TRUE(converted(SetForm::errors, held));
}

// Our own INS's profile, its 24 one group behind the other.
std::string text_of(std::string_view form, std::string_view gyro, std::string_view pos, std::string_view neg,
                    std::string_view of_bias = "") {
  std::ostringstream fields;
  fields << "form = \"" << form << "\"\nfields.accel_bias = { at = 52, type = \"f64\", count = 3" << of_bias
         << " }\nfields.gyro_drift = { at = 76, type = \"f64\", count = 3 }\nfields.accel_scale_pos = { at = 100, type "
            "= \"f64\", count = 3"
         << pos << " }\nfields.accel_scale_neg = { at = 124, type = \"f64\", count = 3" << neg
         << " }\nfields.accel_misalignment = { at = 148, type = \"f64\", count = 3 }\nfields.gyro_scale = { at = 172, "
            "type "
            "= \"f64\", count = 3"
         << gyro << " }\nfields.gyro_misalignment = { at = 196, type = \"f64\", count = 6 }";
  return with(own_text(), "fields.values = { at = 52, type = \"f64\", count = 24 }", fields.str());
}

double f64_at(const Bytes& bytes, std::size_t at) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < 8; ++k) {
    bits = bits << 8U | bytes[at + k];
  }
  return std::bit_cast<double>(bits);
}

TEST(SetForm, ARecordHoldsNominalScaleFactorsOfTheCorrection) {
  const auto profile =
      parse_profile(text_of("correction", ", nominal = 2e-7", ", nominal = 2e-6", ", nominal = 2e-6"), "p.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  ins::Coefficients set;
  set.value[gyro_scale] = 1e-3;
  set.value[plus + 1] = 300e-6;
  set.value[minus + 1] = 100e-6;
  const auto bytes = encode(**profile, set);
  ASSERT_TRUE(bytes) << bytes.error().message;
  EXPECT_NEAR(f64_at(*bytes, 172), 2e-7 / 1.001, 2e-7 * 2e-15);
  EXPECT_NEAR(f64_at(*bytes, 100 + 8), 2e-6 / 1.0003, 2e-6 * 2e-15);
  EXPECT_NEAR(f64_at(*bytes, 124 + 8), 2e-6 / 0.9999, 2e-6 * 2e-15);  // for negative f its sensor has the slope 1 - K-
  EXPECT_DOUBLE_EQ(f64_at(*bytes, 100), 2e-6);
  const auto read = decode_coefficients(**profile, *bytes);
  ASSERT_TRUE(read) << read.error().message;
  for (std::size_t k = 0; k < set.value.size(); ++k) {
    EXPECT_NEAR(read->value[k], set.value[k], 2e-15) << k;
  }
  EXPECT_THAT(describe(**profile, Markup::markdown),
              testing::AllOf(testing::HasSubstr("what the INS corrects with"), testing::HasSubstr("2e-07 (1 + it)"),
                             testing::HasSubstr("2e-06 (1 - it)")));
}

// The service compares what it wrote with what it reads, byte by byte, of a set as the INS would hold it.
RC_GTEST_PROP(SetForm, WhatIsReadBackIsWrittenTheSame, ()) {
  static const std::array texts{text_of("correction-first", "", ", nominal = 3e-6", ""),
                                text_of("correction", ", nominal = 0.7", "", ", scale = 1e-5, unit = \"ppm\"")};
  ins::Coefficients set;
  set.value = drawn_errors(1e-3);
  for (const std::string& text : texts) {
    const auto profile = parse_profile(text, "p.toml");
    RC_ASSERT(profile.has_value());
    const Bytes written = encode(**profile, set).value();
    const auto read = decode_coefficients(**profile, written);
    RC_ASSERT(read.has_value());
    RC_ASSERT(encode(**profile, *read).value() == written);
    for (std::size_t k = 0; k < set.value.size(); ++k) {
      RC_ASSERT(std::abs(read->value[k] - set.value[k]) < 1e-13);
    }
  }
}

TEST(SetForm, FaultsOfTheProfileAreNamed) {
  EXPECT_EQ(complaint(text_of("errors", "", "", "")), "");
  EXPECT_THAT(complaint(text_of("inverse", "", "", "")), testing::HasSubstr("coefficients.form: "));
  EXPECT_THAT(complaint(text_of("errors", ", nominal = 0", "", "")), testing::HasSubstr("gyro_scale.nominal: is 0"));
  EXPECT_THAT(complaint(text_of("errors", ", nominal = 1e-6, unit = \"ppm\"", "", "")),
              testing::HasSubstr("gyro_scale.unit: the number has the unit of nominal"));
  EXPECT_THAT(complaint(text_of("errors", "", "", "", ", nominal = 1.0")),
              testing::HasSubstr("accel_bias.nominal: accel_bias is no scale factor"));
}

}  // namespace
}  // namespace selfcal::profile
