// Speed of the search for laws (README.md): candidate functions a second, and a whole search of 49 minutes at 100 Hz.
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <vector>

#include "daemon/estimate/calibrate_recording.hpp"
#include "estimator/discovery/dictionary.hpp"
#include "estimator/discovery/piece_model.hpp"
#include "estimator/discovery/scene.hpp"
#include "sim_ins/simulate.hpp"

namespace selfcal::bench {
namespace {

using namespace discovery;

constexpr double least_functions_per_s = 10000.0;  // on each axis one more
constexpr double longest_s = 20.0;                 // a diagnosis with discovery

template <typename T>
T or_abort(T&& value) {
  if (!value) {
    std::abort();
  }
  return std::forward<T>(value);
}

// 49 minutes at 100 Hz with one law that no catalogue holds.
const Recording& session() {
  static const Recording recording = [] {
    sim::SimConfig config;
    config.sample_rate_hz = 100.0;
    sim::ConcealedPhysics physics;
    sim::Law law;
    law.axis = 1;
    law.expression = "fx*abs(wz)";
    law.coefficient = 1e-6;
    physics.laws.push_back(law);
    return *or_abort(sim::simulate(config, *named_schedule("horizontal"), 1, physics));
  }();
  return recording;
}

struct Session {
  std::vector<double> temperature;
  ImuData data = imu_view(session(), temperature);
  CalibrationResult calibration = *or_abort(diagnosis::calibrate_still(data, {}).result);
  Scene scene{{data, calibration}};
  PieceSums sums = sum_over_pieces(scene.motion, scene.input, scene.trace);
};

const Session& prepared() {
  static const Session session;
  return session;
}

// Everything that the wide search does for each function: its values, their means over the pieces, score, information, rank.
void functions(benchmark::State& state) {
  const Session& s = prepared();
  std::size_t count = 0;
  for (auto iteration : state) {
    static_cast<void>(iteration);
    const Dictionary dictionary = make_dictionary(s.sums, s.scene.motion.available());
    const PieceModel model(s.sums, dictionary);
    benchmark::DoNotOptimize(model.rank(12));
    count += dictionary.functions.size() * axis_count;
  }
  state.counters["functions/s"] = benchmark::Counter(static_cast<double>(count), benchmark::Counter::kIsRate);
  state.counters["of the least"] =
      benchmark::Counter(static_cast<double>(count) / least_functions_per_s, benchmark::Counter::kIsRate);
}

void whole_search(benchmark::State& state) {
  const Session& s = prepared();
  double runs = 0.0;
  for (auto iteration : state) {
    static_cast<void>(iteration);
    const std::vector<UnitRecording> recordings{{s.data, s.calibration}};
    benchmark::DoNotOptimize(discover(recordings, {}));
    runs += 1.0;
  }
  state.counters["of 20 s"] =
      benchmark::Counter(runs * longest_s, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

BENCHMARK(functions)->Unit(benchmark::kMillisecond);
BENCHMARK(whole_search)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace selfcal::bench

BENCHMARK_MAIN();
