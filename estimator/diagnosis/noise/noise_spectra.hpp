// The noise of a recording's dwells as spectra, for a simulation that is to be like it: what no white noise, quantum or sine holds.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "estimator/diagnosis/noise/band_loudness.hpp"
#include "estimator/diagnosis/noise/coherent_lines.hpp"
#include "estimator/models/imu_data.hpp"
#include "estimator/models/segments.hpp"

namespace selfcal::diagnosis {

// One-sided density, SI/sqrt(Hz), the same between two edges.
struct DensityTable {
  std::vector<double> edges_hz;  // one more than densities
  std::vector<double> density;
  std::vector<BandLoudness> loudness = {};  // where nothing turned in 2e6 samples at most: empty where it is steady
};

struct TiltSpectrum {
  DensityTable table;  // rad/sqrt(Hz)
  std::vector<double>
      above_m;  // of each density: the sensors above the axis that the base turns about at these frequencies
};

struct NoiseSpectra {
  std::array<DensityTable, 6>
      sensors;  // gyros, accelerometers: of increments over the interval, less their quantum and the lines
  // Where something turned: those that go on alike through the dwells.
  std::vector<CoherentLine> lines;
  // Of a base that stands in one attitude all the time with x of b about level: its tilt about x, and about the level
  // axis across it. Empty where it does not show.
  TiltSpectrum roll, pitch;
};

// Quanta of the increments, rad and m/s, are not in the tables: whoever draws noise by them counts in these quanta. None where no
// dwell is long enough (64 samples beside 2 s at either end).
//
// Periodograms (Hann, mean taken out) of pieces of several lengths: long ones below, short ones above, where many can be averaged.
// Neighbouring bins are put together where their scatter is chance. What the gyros integrate to and the accelerometers feel times g
// is tilt of the base, about an axis below or above the sensors, up to where the coherence falls below 0.7.
std::optional<NoiseSpectra> noise_spectra(const ImuData& data, const std::vector<Segment>& segments,
                                          double gyro_quantum, double accel_quantum);

}  // namespace selfcal::diagnosis
