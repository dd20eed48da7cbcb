// Noise by its spectrum: what no white noise, quantum or sine holds.
#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "sim_ins/base_motion.hpp"
#include "sim_ins/random.hpp"

namespace selfcal::sim {

// One-sided density, the same between two edges, none outside them. Of a sensor: of its increments over the sampling interval, so that it
// ends at half of the sampling rate. Of the base: of its tilt.
// How loud the noise of a band is as time goes on, between the band below and `below_hz`: people, wind, an engine. Bands fade
// into each other from that over 1.4 to 1.4 times it.
struct BandLoudness {
  double below_hz = 0.0;      // frequencies above the last band are steady
  double step_s = 1.0;        // of the powers, the first at the start of the recording
  std::vector<double> power;  // of the noise over the table's, straight between steps; the last one stays
};

struct NoiseSpectrum {
  enum class Channel { gyro_x, gyro_y, gyro_z, accel_x, accel_y, accel_z, base_roll, base_pitch };
  Channel channel = Channel::gyro_x;
  std::vector<double> edges_hz;  // rising, one more than densities
  std::vector<double> density;   // rad/s/sqrt(Hz), m/s^2/sqrt(Hz), rad/sqrt(Hz)
  // Of the base, for each density: the sensors above the axis that it turns about. Empty: they are on it.
  std::vector<double> above_m = {};
  std::vector<BandLoudness> loudness = {};  // rising; empty: steady
};

bool of_base(const NoiseSpectrum& spectrum);

// Samples that the noise of a sensor at `rate_hz`, or of the base, repeats after, where it has a loudness; else 0.
double repeats_after(const NoiseSpectrum& spectrum, double rate_hz);

// Gaussian noise of this spectrum, one sample after another. Blocks of random phases (FFT) overlap by half under a window whose
// squares add up to one: the spectrum is the table's, smoothed by the window of a block, which is a quarter of the narrowest band.
// A band of twice the density around it is a line, a dither's or a vibration's: its power is the same in every block.
// With loudness, white noise that is as loud as each time says goes through the root of the table, lines as well: what happens in a second
// stays there as far as the table is smooth. The noise repeats after the power of two of samples that holds the whole loudness.
class SpectrumNoise {
 public:
  SpectrumNoise(const NoiseSpectrum& spectrum, double rate_hz, std::uint64_t seed);
  double next();  // of the rate, SI
  int axis() const { return axis_; }

 private:
  std::vector<double> block();

  int axis_;
  std::vector<double> sigma_;  // of the cosine and of the sine of bin k
  std::vector<bool> line_;     // bin k belongs to a line: a random phase, no random power
  std::vector<double> current_, following_;
  std::size_t half_, at_;
  Random random_;
  bool repeats_ = false;  // current_ is all there is
};

// The same of the base, whose motion needs derivatives: a dozen sines at frequencies drawn evenly from each band, of random amplitude;
// with loudness, a spline of noise.
struct TiltSine {
  Sine tilt;
  double above_m = 0.0;
};
std::vector<TiltSine> sines_of(const NoiseSpectrum& spectrum, std::uint64_t seed);
// Adds the tilt to the base, and what it moves the sensors by.
void add_tilt(const NoiseSpectrum& spectrum, std::uint64_t seed, BaseMotion& base);

}  // namespace selfcal::sim
