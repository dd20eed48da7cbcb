// How loud noise is as time goes on, band by band, for a simulation that is to be loud at the same times.
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace selfcal::diagnosis {

struct BandLoudness {
  double below_hz = 0.0;  // from the band before; both fade into each other from this over 1.4 to 1.4 times it
  double step_s = 0.0;
  std::vector<double> power;  // of the noise over its mean; the first at the first sample
};

// The DFT of a series followed by itself backwards, which has no step at its ends: lines 0 to n of 2n.
std::vector<std::complex<double>> mirrored_lines(const std::vector<double>& series);

// Of noise whose lines, as above, are already over the root of its density. Power is a mean under a Hann window of one over the band's
// width to either side, a second at least. What chance makes of it (Gaussian noise of one loudness: 0.75 of the square of its mean, less where bands fade) is
// taken out of its spread; bands that are steady have one power of 1. Empty: all bands are steady.
std::vector<BandLoudness> loudness_of_bands(const std::vector<std::complex<double>>& whitened, double rate_hz);

// The most samples out of `available` that a DFT takes quickly.
std::size_t quick_length(std::size_t available);

}  // namespace selfcal::diagnosis
