// Gyros, accelerometers and gimbal read-outs: the one that contradicts the other two is named, with its mend, and the
// recording mended as told holds no fault any more.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "estimator/diagnosis/data/faults.hpp"
#include "estimator/diagnosis/ideal_recording.hpp"
#include "estimator/geometry/schedule.hpp"
#include "estimator/geometry/units.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double rate_hz = 10.0;

struct Samples {
  std::vector<std::array<double, 3>> theta, v;
  std::vector<double> outer, inner;
};

using Triad = std::vector<std::array<double, 3>>;

// Measured axis i is sign[i] times axis of[i] of what was there.
void reorder(Triad& triad, std::array<std::size_t, 3> of, std::array<double, 3> sign) {
  for (auto& sample : triad) {
    sample = {sign[0] * sample[of[0]], sign[1] * sample[of[1]], sign[2] * sample[of[2]]};
  }
}

void multiply(std::vector<double>& angles, double by) {
  for (double& angle : angles) {
    angle *= by;
  }
}

// "negate x, y" or "take x = y, y = -z" on one triad.
void mend_triad(Triad& triad, const std::string& words) {
  std::array<std::size_t, 3> of{0, 1, 2};
  std::array<double, 3> sign{1.0, 1.0, 1.0};
  const auto axis = [](char letter) { return static_cast<std::size_t>(letter - 'x'); };
  if (words.starts_with("negate ")) {
    for (const char letter : words.substr(7)) {
      if (letter >= 'x') {
        sign[axis(letter)] = -1.0;
      }
    }
  } else {
    for (std::size_t at = words.find(" = "); at != std::string::npos; at = words.find(" = ", at + 1)) {
      const bool minus = words[at + 3] == '-';
      of[axis(words[at - 1])] = axis(words[at + (minus ? 4 : 3)]);
      sign[axis(words[at - 1])] = minus ? -1.0 : 1.0;
    }
  }
  reorder(triad, of, sign);
}

// Does what the words tell, and nothing else.
void do_as_told(Samples& s, const std::string& words) {
  std::string mend = words.substr(words.rfind("; ") + 2);
  mend = mend.substr(0, mend.find(" ("));  // the doubt
  const auto says = [&](const char* what) { return mend.find(what) != std::string::npos; };
  if (words.starts_with("the read-out")) {
    const bool both = words.starts_with("the read-outs");
    const bool outer = both || words.starts_with("the read-out gimbal_outer_rad");
    if (says("exchange")) {
      std::swap(s.outer, s.inner);
    }
    const double by = (says("negate") ? -1.0 : 1.0) * (says("multiply") ? units::degree : 1.0);
    if (outer && !says("inner one")) {
      multiply(s.outer, by);
    }
    if ((both || !outer) && !says("outer one")) {
      multiply(s.inner, by);
    }
    return;
  }
  if (words.starts_with("gyros") || words.starts_with("the IMU")) {
    mend_triad(s.theta, mend);
  }
  if (words.starts_with("accelerometers") || words.starts_with("the IMU")) {
    mend_triad(s.v, mend);
  }
}

struct Fault {
  const char* name;
  std::function<void(Samples&)> spoil;
  const char* id;
  const char* words;  // that the fault's begin with; empty: no fault
};

const Fault faults[] = {
    {"nothing", [](Samples&) {}, "", ""},
    {"within_half_a_circle",
     [](Samples& s) {
       for (double& angle : s.outer) {
         angle = std::remainder(angle, 2.0 * std::numbers::pi);
       }
       for (double& angle : s.inner) {
         angle = std::remainder(angle, 2.0 * std::numbers::pi);
       }
     },
     "", ""},
    {"outer_reversed", [](Samples& s) { multiply(s.outer, -1.0); }, "wrong_sign",
     "the read-out gimbal_outer_rad is reversed: gyros and accelerometers agree with each other; negate it"},
    {"inner_reversed", [](Samples& s) { multiply(s.inner, -1.0); }, "wrong_sign",
     "the read-out gimbal_inner_rad is reversed: gyros and accelerometers agree with each other; negate it"},
    {"both_reversed",
     [](Samples& s) {
       multiply(s.outer, -1.0);
       multiply(s.inner, -1.0);
     },
     "wrong_sign", "the read-outs gimbal_outer_rad and gimbal_inner_rad are reversed"},
    {"swapped", [](Samples& s) { std::swap(s.outer, s.inner); }, "wrong_axes",
     "the read-outs gimbal_outer_rad and gimbal_inner_rad are swapped: gyros and accelerometers agree with each other; "
     "exchange them"},
    {"degrees",
     [](Samples& s) {
       multiply(s.outer, 1.0 / units::degree);
       multiply(s.inner, 1.0 / units::degree);
     },
     "wrong_scale", "the read-outs gimbal_outer_rad and gimbal_inner_rad are in degrees"},
    {"outer_degrees", [](Samples& s) { multiply(s.outer, 1.0 / units::degree); }, "wrong_scale",
     "the read-out gimbal_outer_rad is in degrees"},
    {"forward_right_down",
     [](Samples& s) {
       reorder(s.theta, {0, 2, 1}, {1.0, 1.0, -1.0});
       reorder(s.v, {0, 2, 1}, {1.0, 1.0, -1.0});
     },
     "wrong_axes", "the IMU's axes: gyros and accelerometers: y gives z, z gives -y (forward-right-down)"},
    {"right_forward_up",
     [](Samples& s) {
       reorder(s.theta, {2, 0, 1}, {1.0, 1.0, 1.0});
       reorder(s.v, {2, 0, 1}, {1.0, 1.0, 1.0});
     },
     "wrong_axes",
     "the IMU's axes: gyros and accelerometers: x gives z, y gives x, z gives y (right-forward-up): they agree with "
     "each "
     "other and not with the gimbal; take x = y, y = z, z = x in both"},
    {"gyros_reversed",
     [](Samples& s) {
       reorder(s.theta, {0, 1, 2}, {-1.0, -1.0, -1.0});
     },
     "wrong_sign",
     "gyros: x gives -x, y gives -y, z gives -z: accelerometers and gimbal agree with each other; negate x, y, z"},
    {"gyros_permuted",
     [](Samples& s) {
       reorder(s.theta, {1, 2, 0}, {1.0, 1.0, 1.0});
     },
     "wrong_axes", "gyros: x gives y, y gives z, z gives x: accelerometers and gimbal agree"},
    {"gyros_two_reversed",
     [](Samples& s) {
       reorder(s.theta, {0, 1, 2}, {-1.0, 1.0, -1.0});
     },
     "wrong_sign", "gyros: x gives -x, z gives -z: accelerometers and gimbal agree"},
    {"accelerometers_reversed",
     [](Samples& s) {
       reorder(s.v, {0, 1, 2}, {-1.0, -1.0, -1.0});
     },
     "wrong_sign",
     "accelerometers: x gives -x, y gives -y, z gives -z: gyros and gimbal agree with each other; negate x, y, z"},
    {"accelerometers_permuted",
     [](Samples& s) {
       reorder(s.v, {2, 1, 0}, {1.0, -1.0, 1.0});
     },
     "wrong_axes", "accelerometers: x gives z, y gives -y, z gives x: gyros and gimbal agree"},
};

struct Place {
  const char* name;
  Schedule (*schedule)();
  Attitude vehicle;  // rad
  double latitude_deg;
};

// Both axes both ways, by 180 and 270 deg at a time: where such a turn begins and ends does not say its sense.
Schedule half_turns() {
  Schedule schedule;
  schedule.rotation_s = 8.0;
  for (const auto& [outer, inner] : std::initializer_list<std::pair<double, double>>{{0.0, 0.0},
                                                                                     {180.0, 0.0},
                                                                                     {180.0, 90.0},
                                                                                     {0.0, 90.0},
                                                                                     {0.0, 270.0},
                                                                                     {90.0, 270.0},
                                                                                     {90.0, 90.0},
                                                                                     {270.0, 90.0},
                                                                                     {270.0, 180.0},
                                                                                     {0.0, 180.0},
                                                                                     {0.0, 0.0},
                                                                                     {90.0, 0.0},
                                                                                     {90.0, 180.0}}) {
    schedule.positions.push_back({outer, inner});
    schedule.dwell_s.push_back(30.0);
  }
  return schedule;
}

const Place places[] = {
    {"horizontal_level", [] { return *named_schedule("horizontal", 30.0, 5.0); }, {0.02, -0.03, 0.6}, 40.0},
    {"horizontal_tilted", [] { return *named_schedule("horizontal", 30.0, 5.0); }, {-0.15, 0.2, 2.6}, -33.0},
    {"table2_tilted", [] { return *named_schedule("table2", 30.0, 5.0); }, {0.1, 0.12, 4.0}, 52.0},
    {"half_turns", half_turns, {-0.1, 0.06, 1.1}, 28.0},
};

class OddOneOut : public testing::TestWithParam<std::tuple<Place, Fault, int>> {};

TEST_P(OddOneOut, IsNamedWithItsMend) {
  const auto& [place, fault, seed] = GetParam();
  const IdealRecording ideal(place.schedule(), place.vehicle, {place.latitude_deg * units::degree, 2.0, 50.0}, rate_hz);
  ImuData data = ideal.data();
  Samples samples;
  samples.theta.assign(data.delta_theta.begin(), data.delta_theta.end());
  samples.v.assign(data.delta_v.begin(), data.delta_v.end());
  samples.outer.assign(data.gimbal_outer.begin(), data.gimbal_outer.end());
  samples.inner.assign(data.gimbal_inner.begin(), data.gimbal_inner.end());
  // Noise, biases and misalignments of real sensors; a gimbal that reads half a degree wrong, with arcseconds of noise.
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal;
  std::array<double, 2> offset{};
  std::array<double, 3> drift{}, bias{};
  for (double& o : offset) {
    o = 0.5 * units::degree * normal(random);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    drift[axis] = 0.05 * units::degree_per_hour * normal(random) / rate_hz;
    bias[axis] = 500.0 * units::micro_g * normal(random) / rate_hz;
  }
  for (std::size_t i = 0; i < samples.v.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      samples.theta[i][axis] += drift[axis] + 5e-8 * normal(random);
      samples.v[i][axis] += bias[axis] + 1e-5 * normal(random);
    }
    samples.outer[i] += offset[0] + 5.0 * units::arcsecond * normal(random);
    samples.inner[i] += offset[1] + 5.0 * units::arcsecond * normal(random);
  }
  const auto faults_of = [&data](const Samples& s) {
    data.delta_theta = s.theta;
    data.delta_v = s.v;
    data.gimbal_outer = s.outer;
    data.gimbal_inner = s.inner;
    return find_data_faults(data);
  };
  fault.spoil(samples);
  const std::vector<DataFault> found = faults_of(samples);
  if (*fault.id == '\0') {
    EXPECT_TRUE(found.empty()) << found.front().words;
    return;
  }
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().id, fault.id) << found.front().words;
  EXPECT_TRUE(found.front().words.starts_with(fault.words)) << found.front().words;
  EXPECT_EQ(found.front().words.find('\n'), std::string::npos);
  do_as_told(samples, found.front().words);
  const std::vector<DataFault> left = faults_of(samples);
  EXPECT_TRUE(left.empty()) << found.front().words << "\nleaves: " << left.front().words;
}

INSTANTIATE_TEST_SUITE_P(Each, OddOneOut,
                         testing::Combine(testing::ValuesIn(places), testing::ValuesIn(faults), testing::Values(1, 2)),
                         [](const testing::TestParamInfo<std::tuple<Place, Fault, int>>& p) {
                           return std::string(std::get<0>(p.param).name) + "_" + std::get<1>(p.param).name + "_" +
                                  std::to_string(std::get<2>(p.param));
                         });

}  // namespace
}  // namespace selfcal::diagnosis
