// Noise drawn by a spectrum, measured by a periodogram of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "estimator/geometry/units.hpp"
#include "sim_ins/noise_spectrum.hpp"
#include "sim_ins/physics.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::sim {
namespace {

using testing::HasSubstr;

constexpr double rate_hz = 100.0;

// Mean one-sided density from low to high, of a Hann window over everything.
double measured(const std::vector<double>& rates, double low_hz, double high_hz) {
  const std::size_t n = rates.size();
  std::vector<double> windowed(n);
  for (std::size_t i = 0; i < n; ++i) {
    windowed[i] =
        rates[i] * (0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n)));
  }
  std::vector<std::complex<double>> lines;
  Eigen::FFT<double>().fwd(lines, windowed);
  const double bin_hz = rate_hz / static_cast<double>(n);
  double sum = 0.0, count = 0.0;
  for (auto k = static_cast<std::size_t>(low_hz / bin_hz); static_cast<double>(k) * bin_hz < high_hz; ++k) {
    sum += 2.0 * std::norm(lines[k]) / (0.375 * static_cast<double>(n) * rate_hz);
    count += 1.0;
  }
  return sum / count;
}

TEST(NoiseSpectrum, HasTheDensityOfItsTable) {
  const NoiseSpectrum table{NoiseSpectrum::Channel::gyro_y, {1.0, 2.0, 10.0, 10.5}, {3.0, 0.0, 20.0}};
  SpectrumNoise noise(table, rate_hz, 4);
  EXPECT_EQ(noise.axis(), 1);
  std::vector<double> rates(std::size_t{1} << 19U);
  for (double& rate : rates) {
    rate = noise.next();
  }
  // 5243 s: 4194 bins from 1.1 to 1.9 Hz, of which a Hann window leaves half independent: 2.2 %. 1573 bins of the second: 3.6 %.
  EXPECT_NEAR(measured(rates, 1.1, 1.9) / 9.0, 1.0, 0.09);
  EXPECT_NEAR(measured(rates, 10.1, 10.4) / 400.0, 1.0, 0.15);
  // The window of a block falls by the fourth power: at 20 of its bins 4e-7 of a bin's power.
  EXPECT_LT(measured(rates, 4.0, 8.0), 1e-4 * 400.0);
  EXPECT_LT(measured(rates, 20.0, 49.0), 1e-5 * 400.0);
}

TEST(NoiseSpectrum, GoesOnAlikeFromBlockToBlock) {
  const NoiseSpectrum white{NoiseSpectrum::Channel::accel_z, {0.0, 50.0}, {2.0}};
  SpectrumNoise noise(white, rate_hz, 9);
  // Variance 4 * 50; the mean square of 64 samples at each place of a block, over 400 blocks of 512.
  std::vector<double> square(8, 0.0);
  for (int block = 0; block < 400; ++block) {
    for (int i = 0; i < 512; ++i) {
      const double value = noise.next();
      square[static_cast<std::size_t>(i / 64)] += value * value / (400.0 * 64.0);
    }
  }
  for (const double variance : square) {
    EXPECT_NEAR(variance / 200.0, 1.0, 4.5 * std::sqrt(2.0 / (400.0 * 64.0)));  // 8 values, each 4.5 sigma
  }
}

// Scatter of the mean square over so many seconds, between seeds, as a share of the mean.
double scatter_of_power(const NoiseSpectrum& table, double seconds) {
  constexpr int seeds = 60;
  double sum = 0.0, squares = 0.0;
  for (int seed = 0; seed < seeds; ++seed) {
    SpectrumNoise noise(table, rate_hz, static_cast<std::uint64_t>(seed));
    double power = 0.0;
    for (int i = 0; i < static_cast<int>(seconds * rate_hz); ++i) {
      power += std::pow(noise.next(), 2.0);
    }
    sum += power;
    squares += power * power;
  }
  const double mean = sum / seeds;
  return std::sqrt(squares / seeds - mean * mean) / mean;
}

// Normal noise of B Hz has in T seconds a power that is known to 1/sqrt(B T): here 0.087. That of a line, whose neighbours have a
// hundredth of its density, is to be known better; between normal noises the ratio of two such scatters is within 0.69 and 1.45 in 99.5 % of
// cases (F with 59 and 59 degrees).
TEST(NoiseSpectrum, APowerOfALineIsNotDrawn) {
  const NoiseSpectrum line{NoiseSpectrum::Channel::gyro_x, {0.0, 9.9, 10.1, 50.0}, {0.01, 1.0, 0.01}};
  const NoiseSpectrum band{NoiseSpectrum::Channel::gyro_x, {9.9, 10.1}, {1.0}};
  const double of_line = scatter_of_power(line, 655.0), of_band = scatter_of_power(band, 655.0);
  EXPECT_NEAR(of_band, 0.087, 0.03);
  EXPECT_LT(of_line, 0.69 * of_band);
}

TEST(NoiseSpectrum, OfTheBaseAreSinesOfItsDensity) {
  const NoiseSpectrum table{NoiseSpectrum::Channel::base_roll, {0.001, 0.002, 0.01}, {5.0, 1.0}};
  double below = 0.0, above = 0.0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    for (const auto& [sine, above_m] : sines_of(table, seed)) {
      const double hz = 1.0 / sine.period_s;
      ASSERT_TRUE(hz >= 0.001 && hz <= 0.01);
      (hz < 0.002 ? below : above) += 0.5 * sine.amplitude * sine.amplitude / 50.0;
    }
  }
  // Chi-squared of 50 x 8 x 2 degrees of freedom: 5 %, and less above.
  EXPECT_NEAR(below / (25.0 * 0.001), 1.0, 0.2);
  EXPECT_NEAR(above / (1.0 * 0.008), 1.0, 0.2);
}

// A base that rolls: gyro x feels the rate, accelerometer z the angle times g.
TEST(NoiseSpectrum, TiltIsOneMotionForBothTriads) {
  SimConfig config;
  config.parameter_set = "none";
  config.sample_rate_hz = 50.0;
  config.gyro_arw_deg_per_sqrt_h = config.accel_vrw_ug_per_sqrt_hz = 0.0;
  config.gyro_lsb_arcsec = 1e-4;
  config.accel_lsb_m_per_s = 1e-9;
  const Schedule still{{{0.0, 0.0}}, {400.0}, 5.0};
  const auto clean = simulate(config, still, 5, {});
  const auto rolling = simulate(config, still, 5,
                                *parse_physics("[[spectrum]]\nchannel='base_roll'\nunit='arcsec/sqrt(Hz)'\n"
                                               "edges_hz=[0.005, 0.05]\ndensity=[500]\n",
                                               "p"));
  ASSERT_TRUE(clean && rolling);
  double angle = 0.0, first = 0.0, largest = 0.0, off = 0.0, sign = 0.0;
  for (std::size_t i = 0; i < clean->time_s.size(); ++i) {
    const double turned = rolling->delta_theta_rad[i][0] - clean->delta_theta_rad[i][0];
    const double tilt = (rolling->delta_v_mps[i][2] - clean->delta_v_mps[i][2]) * config.sample_rate_hz / 9.80;
    sign = sign == 0.0 && std::abs(turned) > 0.0 && i > 0 ? std::copysign(1.0, turned * (tilt - first)) : sign;
    first = i == 0 ? tilt : first;
    angle += turned;
    largest = std::max(largest, std::abs(tilt));
    off = std::max(off, std::abs(sign * (tilt - first) - angle));
  }
  // 500 arcsec/sqrt(Hz) over 0.045 Hz: 106 arcsec rms. Force is the mean over a sample, 10 ms late: at 0.05 Hz 0.3 %.
  EXPECT_GT(largest, 50.0 * units::arcsecond);
  EXPECT_LT(off, 0.02 * largest);
}

// Bow up moves what stands above the axis back: the force is g angle - above_m d2(angle)/dt2, at 1 Hz less by 39.5 * above_m / 9.8.
TEST(NoiseSpectrum, TiltAboutAnAxisBelowMovesTheSensors) {
  NoiseSpectrum table{NoiseSpectrum::Channel::base_pitch, {0.9, 1.1, 1.2}, {1e-4, 1e-4}, {1.5, -0.5}};
  BaseMotion base;
  add_tilt(table, 3, base);
  ASSERT_EQ(base.pitch.size(), base.surge.size());
  EXPECT_TRUE(base.roll.empty() && base.sway.empty());
  for (std::size_t k = 0; k < base.pitch.size(); ++k) {
    const double above_m = base.pitch[k].period_s > 1.0 / 1.1 ? 1.5 : -0.5;
    EXPECT_DOUBLE_EQ(base.surge[k].amplitude, -above_m * base.pitch[k].amplitude);
    EXPECT_DOUBLE_EQ(base.surge[k].period_s, base.pitch[k].period_s);
    EXPECT_DOUBLE_EQ(base.surge[k].phase, base.pitch[k].phase);
  }
  table.channel = NoiseSpectrum::Channel::base_roll;
  add_tilt(table, 3, base);
  ASSERT_EQ(base.roll.size(), base.sway.size());
  EXPECT_DOUBLE_EQ(base.sway[0].amplitude, 1.5 * base.roll[0].amplitude);
}

// Half of the time 1.9 of the power below 4 Hz, 0.1 in the other half; a quarter of a decade beside the edge both are their own.
NoiseSpectrum loud_in_its_first_half(NoiseSpectrum::Channel channel, std::vector<double> edges_hz, double half_s) {
  NoiseSpectrum table{channel, std::move(edges_hz), {3.0}};
  table.loudness = {{4.0, 0.5 * half_s, {1.9, 1.9, 0.1, 0.1}}};
  return table;
}

// 16384 samples each; the loudness goes over between the second and the third of its four times.
TEST(NoiseSpectrum, IsAsLoudAsEachTimeSays) {
  constexpr std::size_t half = 32768;
  SpectrumNoise noise(loud_in_its_first_half(NoiseSpectrum::Channel::gyro_z, {0.0, 50.0}, half / rate_hz), rate_hz, 7);
  std::vector<double> first(half / 2), between(half / 2), last(half);
  for (std::vector<double>* part : {&first, &between, &last}) {
    std::generate(part->begin(), part->end(), [&] { return noise.next(); });
  }
  // 164 s: 410 and 328 bins of 0.5 to 3 Hz, half of them independent: 7 and 5 %. Above 6 Hz 7200 and more.
  EXPECT_NEAR(measured(first, 0.5, 2.8) / (9.0 * 1.9), 1.0, 0.3);
  EXPECT_NEAR(measured(last, 0.5, 2.8) / (9.0 * 0.1), 1.0, 0.25);
  EXPECT_NEAR(measured(first, 6.0, 49.0) / 9.0, 1.0, 0.08);
  EXPECT_NEAR(measured(last, 6.0, 49.0) / 9.0, 1.0, 0.06);
  // It repeats after the whole loudness.
  SpectrumNoise again(loud_in_its_first_half(NoiseSpectrum::Channel::gyro_z, {0.0, 50.0}, half / rate_hz), rate_hz, 7);
  EXPECT_DOUBLE_EQ(again.next(), noise.next());
}

// Tilt by a spline: its rate and acceleration are its derivatives, what it moves the sensors by follows from the height at the frequency,
// and it is loud when it should be. Density 3 rad/sqrt(Hz) from 0.4 to 0.5 Hz.
TEST(NoiseSpectrum, ATiltThatIsLoudAtTimesIsOneMotion) {
  constexpr double half_s = 2000.0, above_m = 0.7;
  NoiseSpectrum table = loud_in_its_first_half(NoiseSpectrum::Channel::base_pitch, {0.4, 0.5}, half_s);
  table.above_m = {above_m};
  EXPECT_DOUBLE_EQ(repeats_after(table, rate_hz), 16384.0);  // 4000 s of 8 x 0.5 Hz
  BaseMotion base;
  add_tilt(table, 3, base);
  const auto at = [&](double t) { return base_state(base, {}, t); };
  double loud = 0.0, quiet = 0.0;
  constexpr int times = 2000;
  for (int k = 0; k < times; ++k) {
    const double t = 100.0 + 0.35 * k;
    constexpr double step_s = 1e-3;
    const BaseState before = at(t - step_s), now = at(t), behind = at(t + step_s);
    // Of the third and fourth derivatives, with 3.1 rad/s: below 1e-5 of the rate and the acceleration.
    EXPECT_NEAR(now.attitude_rate.pitch, (behind.attitude.pitch - before.attitude.pitch) / (2.0 * step_s), 1e-4);
    EXPECT_NEAR(now.a_n.x(), (behind.v_n.x() - before.v_n.x()) / (2.0 * step_s), 1e-3);
    EXPECT_NEAR(now.p_n.x(), -above_m * now.attitude.pitch, 1e-9);
    loud += now.attitude.pitch * now.attitude.pitch / times;
  }
  for (int k = 0; k < times; ++k) {
    const double pitch = at(2600.0 + 0.65 * k).attitude.pitch;
    quiet += pitch * pitch / times;
  }
  // 0.1 Hz and 700 s: 70 independent squares, 12 %; 130, 9 %.
  EXPECT_NEAR(loud / (9.0 * 0.1 * 1.9), 1.0, 0.5);
  EXPECT_NEAR(quiet / (9.0 * 0.1 * 0.1), 1.0, 0.4);
}

TEST(NoiseSpectrum, FilesNameWhatIsWrong) {
  const auto message = [](const std::string& text) {
    const auto read = parse_physics("[[spectrum]]\n" + text, "p.toml");
    return read ? std::string("accepted") : read.error().message;
  };
  const std::string gyro = "channel='gyro_x'\nunit='deg/h/sqrt(Hz)'\n";
  EXPECT_EQ(message(gyro + "edges_hz=[0, 1]\ndensity=[2]\n"), "accepted");
  EXPECT_THAT(message("channel='mag_x'\n"), HasSubstr("p.toml:2: spectrum[0].channel: no channel is called mag_x"));
  EXPECT_THAT(message("channel='gyro_x'\nunit='ug/sqrt(Hz)'\n"), HasSubstr("p.toml:3: spectrum[0].unit"));
  EXPECT_THAT(message(gyro + "edges_hz=[0, 1]\ndensity=[2, 3]\n"), HasSubstr("2 edges where 2 densities"));
  EXPECT_THAT(message(gyro + "edges_hz=[0, 2, 1]\ndensity=[2, 3]\n"), HasSubstr("1 after 2 Hz"));
  EXPECT_THAT(message(gyro + "edges_hz=[0, 1]\ndensity=[-2]\n"), HasSubstr("p.toml:5: spectrum[0].density"));
  EXPECT_THAT(message(gyro + "edges_hz=[0, 1]\ndensity=['a']\n"), HasSubstr("not an array of numbers"));
  EXPECT_THAT(message(gyro + "edges_hz=7\ndensity=[1]\n"), HasSubstr("edges_hz: not an array of numbers"));
  const std::string base = "channel='base_roll'\nunit='arcsec/sqrt(Hz)'\nedges_hz=[0, 1, 2]\ndensity=[2, 3]\n";
  EXPECT_EQ(message(base + "above_m=0.5\n"), "accepted");
  EXPECT_EQ(message(base + "above_m=[0.5, 0.6]\n"), "accepted");
  EXPECT_THAT(message(base + "above_m=[0.5]\n"), HasSubstr("1 heights where there are 2 densities"));
  EXPECT_THAT(message(base + "above_m='high'\n"), HasSubstr("p.toml:6: spectrum[0].above_m"));
  EXPECT_THAT(message(gyro + "edges_hz=[0, 1]\ndensity=[2]\nabove_m=1\n"), HasSubstr("above_m"));
  const std::string loud = gyro + "edges_hz=[0, 1]\ndensity=[2]\n[[spectrum.loudness]]\n";
  EXPECT_EQ(message(loud + "below_hz=1\nstep_s=2\npower=[1, 0]\n"), "accepted");
  EXPECT_THAT(message(loud + "step_s=2\npower=[1]\n"), HasSubstr("0 Hz is not above 0 Hz"));
  EXPECT_THAT(message(loud + "below_hz=1\nstep_s=2\npower=[]\n"), HasSubstr("0 values where"));
  EXPECT_THAT(message(loud + "below_hz=1\nstep_s=2\npower=[-1]\n"), HasSubstr("spectrum[0].loudness[0].power"));
  EXPECT_THAT(message(loud + "below_hz=1\nstep_s=0\npower=[1]\n"), HasSubstr("spectrum[0].loudness[0].step_s"));
  EXPECT_THAT(message(loud + "below_hz=1\nstep_s=90000\npower=[1, 1]\n"), HasSubstr("are longer than 100000 s"));
  EXPECT_THAT(message(gyro + "edges_hz=[0, 1]\ndensity=[2]\n[[spectrum]]\n" + gyro + "edges_hz=[0, 1]\ndensity=[2]\n"),
              HasSubstr("gyro_x has a spectrum already"));
}

// A day at a megahertz is not drawn.
TEST(NoiseSpectrum, ALoudnessThatIsTooLongIsRefused) {
  const auto physics = parse_physics(
      "[[spectrum]]\nchannel='base_roll'\nunit='arcsec/sqrt(Hz)'\nedges_hz=[0, 1000000]\n"
      "density=[1]\n[[spectrum.loudness]]\nbelow_hz=1\nstep_s=50000\npower=[1, 2]\n",
      "p");
  ASSERT_TRUE(physics);
  const auto simulated = simulate({}, {{{0.0, 0.0}}, {10.0}, 5.0}, 5, *physics);
  ASSERT_FALSE(simulated);
  EXPECT_THAT(simulated.error().message, HasSubstr("the loudness of a spectrum makes"));
}

}  // namespace
}  // namespace selfcal::sim
