// Density of a gyro's white noise behind a quantum that is larger than the noise.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "estimator/models/segments.hpp"

namespace selfcal {

struct QuantisedRate {
  double white_asd = 0.0;        // rad/s/sqrt(Hz), mean of the axes; 0: too short a recording to say
  double white_sigma = 0.0;      // of it: chance, the angle that is fitted beside it, and what the quantum hides
  double increment_sigma = 0.0;  // white angle, the quantum's share included: rad
};

// Whittle's fit of white rate and white angle to the dwells below 1 Hz, beside the spectrum that the quantum has at each
// dwell's rate. `increments` in rad are multiples of `quantum` rad whose remainders are carried on; `piece_s` is the length of a
// piece of a dwell, `first_asd` > 0 a first guess within a factor of some hundreds. Harmonics of a fast rate (gravity's in counts) lie where the
// dwell's mean tells them to less than a bin: bins in which the quantum has more than `most_hidden` of the rest are left out, and
// the first guess is the lower quartile of all bins.
QuantisedRate fit_quantised_rate(std::span<const std::array<double, 3>> increments, double rate_hz,
                                 const std::vector<Segment>& segments, double quantum, double piece_s, double first_asd,
                                 double most_hidden = std::numeric_limits<double>::infinity());

// Spectral density (two-sided, (rad/s)^2/Hz) at frequency_hz of the error of a rate whose angle, at a steady mean rate
// (rad/s), walks with white_asd (rad/s/sqrt(Hz)) and is put out in multiples of `quantum` (rad) at rate_hz.
double quantum_density(double frequency_hz, double mean_rate, double quantum, double white_asd, double rate_hz);

}  // namespace selfcal
