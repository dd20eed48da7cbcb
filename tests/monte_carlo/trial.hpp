// One run: simulate, calibrate, compare with the truth and with the bound.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "estimator/passes/calibration.hpp"
#include "tests/monte_carlo/cases.hpp"

namespace selfcal::monte_carlo {

// Normalised squared error on the subspace that the estimator calls determined: over the eigenvectors of its
// covariance, in units of the tolerances, whose sigma is at most one tolerance.
struct Nees {
  double sum = 0.0;
  int degrees = 0;
};

// Calibrations whose covariance must be found wanting.
enum class Control { noise_halved, noise_doubled, carried };
inline constexpr std::array<std::string_view, 3> control_names = {"noise / 2", "noise x 2", "carried covariance"};

struct Trial {
  std::uint64_t seed = 0;
  std::string failure;          // not empty: no answer
  ParameterVector error_bound;  // error over the bound of this very run
  ParameterVector error_plan;   // error over what predict() promises for the commanded schedule
  ParameterVector own_bound;    // the estimator's own sigma over the bound
  Nees nees;
  Nees gyro_drift;                                  // the three drifts alone, with their own covariance
  std::array<Nees, control_names.size()> controls;  // zero degrees: not run
  Verdict verdict = Verdict::consistent;
  int passes = 0;
  double nis = 0.0;
  double arw_ratio = 0.0, vrw_ratio = 0.0;  // noise densities found, over the true ones
};

Trial run_trial(const Case& c, double sample_rate_hz, std::uint64_t seed, bool with_controls);

}  // namespace selfcal::monte_carlo
