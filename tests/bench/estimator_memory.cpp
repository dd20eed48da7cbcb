// Peak memory of a whole calibration against that of its samples: exit 1 above 1.5 times (README.md).
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "estimator/passes/calibration.hpp"
#include "tests/bench/estimator_data.hpp"

namespace selfcal::bench {
namespace {

constexpr double limit = 1.5;

// A line of /proc/self/status such as "VmHWM:   12345 kB", in bytes.
double status_bytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    if (word == key + ":") {
      double kilobytes = 0.0;
      status >> kilobytes;
      return 1024.0 * kilobytes;
    }
  }
  return 0.0;
}

// What the samples and the calibration occupy at the highest; the program itself is taken off.
double peak_ratio(double minutes) {
  const double program = status_bytes("VmRSS");
  const Samples samples = ideal_samples(60.0 * minutes, 200.0);
  CalibrationOptions options;  // ideal data have no noise to be found
  options.noise.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
  options.noise.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
  const CalibrationOutcome outcome = calibrate(samples.view(), options);
  const double peak = status_bytes("VmHWM") - program;
  fmt::print("{:.0f} min at 200 Hz: samples {:.1f} MB, peak {:.1f} MB: {:.3f} x, {}\n", minutes, samples.bytes() / 1e6,
             peak / 1e6, peak / samples.bytes(),
             outcome.result ? fmt::format("{} passes", outcome.result->passes.size()) : outcome.failure.message);
  return outcome.result ? peak / samples.bytes() : HUGE_VAL;
}

}  // namespace
}  // namespace selfcal::bench

int main(int argc, char** argv) {
  const double minutes = argc > 1 ? std::atof(argv[1]) : 49.0;
  return minutes >= 10.0 && selfcal::bench::peak_ratio(minutes) <= selfcal::bench::limit ? 0 : 1;
}
