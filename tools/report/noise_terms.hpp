// The noise terms that an Allan deviation shows, in the conventions of IEEE Std 952-1997, annex C.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "tools/report/allan_deviation.hpp"

namespace selfcal::report {

// Of the Allan variance against the averaging time tau:
//   3 Q^2 / tau^2  +  N^2 / tau  +  (2 ln 2 / pi) B^2  +  K^2 tau / 3  +  R^2 tau^2 / 2
enum class NoiseTerm { quantisation, random_walk, bias_instability, rate_random_walk, ramp };
inline constexpr int noise_term_count = 5;

struct NoiseTermFit {
  NoiseTerm term = NoiseTerm::random_walk;
  double coefficient = 0.0;  // Q, N, B, K or R in SI: the sensor's unit times s, sqrt(s), 1, 1/sqrt(s), 1/s
  double sigma = 0.0;
};

struct NoiseFit {
  std::vector<NoiseTermFit> terms;  // those that the points support, in the order of NoiseTerm; empty: none
  double misfit = 0.0;              // chi-squared of the points over its degrees of freedom, 1 expected
};

// Exponent of tau in the Allan *deviation*: -1, -1/2, 0, +1/2, +1.
double slope_of(NoiseTerm term);
// Allan deviation of the term alone at tau.
double deviation_of(const NoiseTermFit& fit, double tau_s);

// Weighted fit to the points of one sensor (0 to 5, as in AllanPoint). Of all sets of terms whose squared
// coefficients exceed `support_sigma` of their sigma each, that of the least BIC (gamma likelihood of the variances).
// The terms are fitted to one point an octave, for neighbours share their data. A fit that misses the points widens
// every sigma by the square root of its misfit.
NoiseFit fit_noise_terms(const std::vector<AllanPoint>& points, std::size_t sensor);

inline constexpr double support_sigma = 3.0;

}  // namespace selfcal::report
