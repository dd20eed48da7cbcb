// The remainders of a count make lines of a steady rate. Here the counts are made one by one, and their spectrum is looked at.
#include "estimator/diagnosis/noise/quantum_beat.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "estimator/diagnosis/noise/noise_check.hpp"
#include "tests/unit/estimator/simulated.hpp"

namespace selfcal::diagnosis {
namespace {

constexpr double sample_rate_hz = 100.0, quantum = 1e-3;
constexpr std::size_t samples = 20000;

// Rates, mean taken out, of increments counted with the remainders carried on.
std::vector<double> counted(double rate) {
  std::vector<double> rates;
  double before = 0.0;
  for (std::size_t i = 1; i <= samples; ++i) {
    const double now = std::floor(rate * static_cast<double>(i) / sample_rate_hz / quantum) * quantum;
    rates.push_back((now - before) * sample_rate_hz - rate);
    before = now;
  }
  return rates;
}

double amplitude_at(const std::vector<double>& rates, double frequency_hz) {
  std::complex<double> sum = 0.0;
  double weights = 0.0;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const double t = static_cast<double>(i) / sample_rate_hz;
    const double weight =
        1.0 - std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(rates.size()));
    sum += weight * rates[i] * std::polar(1.0, -2.0 * std::numbers::pi * frequency_hz * t);
    weights += weight;
  }
  return 2.0 * std::abs(sum) / weights;
}

// Every frequency at which the counts have a line is one of the beats, and elsewhere none is told.
TEST(QuantumBeat, LinesOfCountsAreBeats) {
  constexpr double step_hz = 0.01, width_hz = 0.03, seen = 2e-3;
  std::mt19937_64 engine(4);
  for (int k = 0; k < 4; ++k) {
    const double rate = quantum * std::uniform_real_distribution<double>(0.3, 60.0)(engine);
    const std::vector<double> rates = counted(rate);
    int lines = 0, told = 0;
    for (int step = 50; step < 2000; ++step) {
      const double f = step * step_hz;
      const double amplitude = amplitude_at(rates, f);
      const bool beat = beat_of_quantum({rate, 0.0, quantum, sample_rate_hz}, f, seen, width_hz);
      told += beat ? 1 : 0;
      if (amplitude > seen) {
        ++lines;
        EXPECT_TRUE(beat) << "rate " << rate / quantum << " counts/s, " << f << " Hz, " << amplitude;
      }
    }
    EXPECT_GT(lines, 0);
    EXPECT_LT(told, 1950 / 3) << rate / quantum;  // a third of all frequencies
  }
}

TEST(QuantumBeat, WithoutAQuantumThereIsNone) { EXPECT_FALSE(beat_of_quantum({1.0, 0.0, 0.0, 100.0}, 5.0, 1e-9, 1.0)); }

// However weak a line, harmonics without end are not looked at: beyond one for each band none is in a new one. Two are of a rate of half
// a count a sample.
TEST(QuantumBeat, TheWeakestLineIsAnsweredToo) {
  constexpr double nothing = 1e-300, width_hz = 0.03;
  EXPECT_TRUE(beat_of_quantum({0.5 * quantum * sample_rate_hz, 0.0, quantum, sample_rate_hz}, 50.0, nothing, width_hz));
  EXPECT_FALSE(
      beat_of_quantum({0.5 * quantum * sample_rate_hz, 0.0, quantum, sample_rate_hz}, 20.0, nothing, width_hz));
}

// A coarse quantum beside little noise on a turning gimbal: lines of the dwells are its own, but for one that is put in.
NoiseCheck check_of(double line_mps2) {
  sim::SimConfig config;
  config.sample_rate_hz = sample_rate_hz;
  config.accel_vrw_ug_per_sqrt_hz = 3.0;
  config.gyro_lsb_arcsec = 0.4;
  config.accel_lsb_m_per_s = 4e-4;
  constexpr std::uint64_t seed = 5;
  Recording recording = *sim::simulate(config, *named_schedule("horizontal", 120.0, 5.0), seed, {});
  // What is added is counted as well: its remainder is carried on.
  constexpr double frequency_hz = 7.3;
  double rest = 0.0;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    rest += line_mps2 / sample_rate_hz * std::sin(2.0 * std::numbers::pi * frequency_hz * recording.time_s[i]);
    const double counts = std::round(rest / config.accel_lsb_m_per_s);
    recording.delta_v_mps[i][1] += counts * config.accel_lsb_m_per_s;
    rest -= counts * config.accel_lsb_m_per_s;
  }
  const ImuData data = test::view_of(recording);
  return check_noise(data, find_segments(data), {config.gyro_lsb_arcsec * units::arcsecond, config.accel_lsb_m_per_s});
}

int accelerometer_lines(const NoiseCheck& check) {
  int lines = 0;
  for (const VibrationLine& line : check.lines) {
    lines += line.axis >= 3 && line.log_p < std::log(1e-3) ? 1 : 0;
  }
  return lines;
}

TEST(QuantumBeat, NoLineOfADwellIsVibration) { EXPECT_EQ(accelerometer_lines(check_of(0.0)), 0); }

TEST(QuantumBeat, AVibrationIsSeenBesideThem) {
  constexpr double amplitude = 0.05;  // m/s^2: 1.1 mm/s of velocity, three counts
  const NoiseCheck check = check_of(amplitude);
  bool seen = false;
  for (const VibrationLine& line : check.lines) {
    seen = seen || (line.axis == 4 && std::abs(line.frequency_hz - 7.3) < 0.1 &&
                    std::abs(line.amplitude / amplitude - 1.0) < 0.2);
  }
  EXPECT_TRUE(seen);
}

}  // namespace
}  // namespace selfcal::diagnosis
