// Random numbers that are the same bits on every machine for the same seed: the standard's own distributions are not.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace selfcal::sim {

class Random {
 public:
  // Streams of one seed are independent: a new user of random numbers takes a new stream and disturbs no other.
  Random(std::uint64_t seed, std::uint64_t stream) : engine_(mixed(seed + mixed(stream))) {}

  std::uint64_t bits() { return engine_(); }
  // [0, 1), 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  // Standard normal: Marsaglia's polar method, which gives two at a time.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    double u = 0.0;
    double v = 0.0;
    double s = 0.0;
    do {
      u = 2.0 * uniform() - 1.0;
      v = 2.0 * uniform() - 1.0;
      s = u * u + v * v;
    } while (s >= 1.0 || s == 0.0);
    const double factor = std::sqrt(-2.0 * std::log(s) / s);
    spare_ = v * factor;
    has_spare_ = true;
    return u * factor;
  }

 private:
  static std::uint64_t mixed(std::uint64_t x) {  // splitmix64's output function
    x += 0x9e3779b97f4a7c15U;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
    return x ^ (x >> 31);
  }

  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace selfcal::sim
