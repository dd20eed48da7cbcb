#include "estimator/diagnosis/noise/quantum_beat.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selfcal::diagnosis {

bool beat_of_quantum(const CountedRate& counted, double frequency_hz, double amplitude, double width_hz) {
  if (!(counted.quantum > 0.0) || !(amplitude > 0.0)) {
    return false;
  }
  const double fs = counted.sample_rate_hz;
  const double cycles_hz = std::abs(counted.mean_rate) / counted.quantum;
  // Increments over the interval: of a sine of an angle the difference between its ends.
  const double first = 2.0 * fs * counted.quantum / std::numbers::pi * std::sin(std::numbers::pi * frequency_hz / fs);
  // Harmonics in the number of the bands lie in each of them or repeat.
  const int last = static_cast<int>(std::min(first / amplitude, std::ceil(fs / width_hz)));
  for (int k = 1; k <= last; ++k) {
    const double folded = std::abs(std::remainder(k * cycles_hz, fs));
    if (std::abs(folded - frequency_hz) < width_hz + k * counted.wanders / counted.quantum) {
      return true;
    }
  }
  return false;
}

}  // namespace selfcal::diagnosis
