// Speed of the calibration (README.md): three passes over 49 minutes at 200 Hz, and time against length and rate.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <vector>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/models/segments.hpp"
#include "estimator/models/sensor_noise.hpp"
#include "estimator/navigation/coarse_alignment.hpp"
#include "estimator/passes/calibration.hpp"
#include "sim_ins/simulate.hpp"
#include "tests/bench/estimator_data.hpp"

namespace selfcal::bench {
namespace {

constexpr double limit_s = 0.5;       // three passes over 588,000 samples
constexpr double session_s = 2940.0;  // 19 dwells of 150 s and 18 moves of 5 s
constexpr double session_rate_hz = 200.0;

NoiseModel noise() {
  NoiseModel n;
  n.gyro_arw = 0.001 * units::degree_per_sqrt_hour;
  n.accel_vrw = 5.0 * units::micro_g_per_sqrt_hz;
  return n;
}

void three_passes(const ImuData& data) {
  PassInput input;
  input.data = &data;
  input.noise = noise();
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  for (const double sign : {1.0, -1.0, 1.0}) {
    input.sign = sign;
    const PassOutput out = run_pass(input);
    benchmark::DoNotOptimize(out.nis_mean);
    input.C_nb = out.C_nb;
  }
}

const Recording& session() {
  static const Recording recording = [] {
    auto made = sim::simulate({}, *named_schedule("horizontal"), 1, {});
    if (!made) {
      std::abort();
    }
    return std::move(*made);
  }();
  return recording;
}

ImuData session_data() {
  static std::vector<double> temperature;
  return imu_view(session(), temperature);
}

void passes_of_a_session(benchmark::State& state) {
  const Samples samples = ideal_samples(session_s, session_rate_hz);
  const ImuData data = samples.view();
  for (auto _ : state) {
    three_passes(data);
  }
  state.counters["of_limit"] = benchmark::Counter(limit_s * static_cast<double>(state.iterations()),
                                                  benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(passes_of_a_session)->Unit(benchmark::kMillisecond);

// The whole calibration of a simulated session, noise unknown.
void calibration_of_a_session(benchmark::State& state) {
  const ImuData data = session_data();
  std::size_t passes = 0;
  for (auto _ : state) {
    const CalibrationOutcome outcome = calibrate(data, {});
    passes = outcome.result->passes.size();
  }
  state.counters["passes"] = static_cast<double>(passes);
}
BENCHMARK(calibration_of_a_session)->Unit(benchmark::kMillisecond);

// Where the time of a pass goes: navigation with its sensitivities, and the filter, which is the rest of it.
void navigation_of_a_session(benchmark::State& state) {
  const Samples samples = ideal_samples(session_s, session_rate_hz);
  const ImuData data = samples.view();
  for (auto _ : state) {
    IntervalNavigator navigator(data, ParameterVector::Zero(), Matrix3::Identity(), 1.0, 1.0);
    Interval interval;
    while (navigator.next(interval)) {
      benchmark::DoNotOptimize(interval.drive);
    }
  }
}
BENCHMARK(navigation_of_a_session)->Unit(benchmark::kMillisecond);

void one_pass_of_a_session(benchmark::State& state) {
  const Samples samples = ideal_samples(session_s, session_rate_hz);
  const ImuData data = samples.view();
  PassInput input;
  input.data = &data;
  input.noise = noise();
  input.prior.parameter_sigma = 2.0 * plausible_limit();
  for (auto _ : state) {
    const PassOutput out = run_pass(input);
    benchmark::DoNotOptimize(out.nis_mean);
  }
}
BENCHMARK(one_pass_of_a_session)->Unit(benchmark::kMillisecond);

void noise_of_a_session(benchmark::State& state) {
  const ImuData data = session_data();
  for (auto _ : state) {
    const SensorNoise found = estimate_sensor_noise(data, find_segments(data));
    benchmark::DoNotOptimize(found.gyro.white_asd);
  }
}
BENCHMARK(noise_of_a_session)->Unit(benchmark::kMillisecond);

void alignment_of_a_session(benchmark::State& state) {
  const ImuData data = session_data();
  for (auto _ : state) {
    const CoarseAlignment found = coarse_alignment(data, 150.0);
    benchmark::DoNotOptimize(found.gravity);
  }
}
BENCHMARK(alignment_of_a_session)->Unit(benchmark::kMillisecond);

void against_samples(benchmark::State& state, const Samples& samples) {
  const ImuData data = samples.view();
  for (auto _ : state) {
    three_passes(data);
  }
  state.SetComplexityN(static_cast<std::int64_t>(data.size()));
  const double sampled = 3.0 * static_cast<double>(data.size()) * static_cast<double>(state.iterations());
  state.counters["per_sample_and_pass"] =
      benchmark::Counter(sampled, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

// Three passes against the length: minutes at 200 Hz, up to a day.
void by_length(benchmark::State& state) {
  against_samples(state, ideal_samples(60.0 * static_cast<double>(state.range(0)), session_rate_hz));
}
BENCHMARK(by_length)
    ->Arg(10)
    ->Arg(49)
    ->Arg(180)
    ->Arg(720)
    ->Arg(1440)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);

// Against the rate, 49 minutes: a part for every interval (the filter), which the rate does not change, and a part
// for every sample.
void by_rate(benchmark::State& state) {
  against_samples(state, ideal_samples(session_s, static_cast<double>(state.range(0))));
}
BENCHMARK(by_rate)
    ->Arg(50)
    ->Arg(100)
    ->Arg(200)
    ->Arg(500)
    ->Arg(1000)
    ->Arg(2000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oN);

}  // namespace
}  // namespace selfcal::bench

BENCHMARK_MAIN();
