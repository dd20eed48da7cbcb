// Figures of one case over all its runs, and whether they are within the limits.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/monte_carlo/trial.hpp"

namespace selfcal::monte_carlo {

// Limits. The overall and the single ratio are the project's (issue "estimator at the physical limit"); where few runs
// scatter more than that allows, a ratio is held against chance instead: the quantile of chi-squared at `confidence`
// (single: shared among the 24).
struct Limits {
  double overall = 1.10;
  double single = 1.35;
  double confidence = 0.95;  // of the NEES interval
};

struct Ratio {
  double value = 0.0, low = 0.0, high = 0.0;  // within [low, high] is right
  bool holds() const { return value >= low && value <= high; }
};

struct CaseReport {
  std::string name;
  int runs = 0;
  std::vector<std::string> failures;  // seed and reason
  Ratio overall;                      // rms(error)/bound
  std::array<Ratio, sensor_parameter_count> single;
  double overall_plan = 0.0;    // rms(error)/plan over the determined parameters' subspace: for information
  ParameterVector own_bound;    // the estimator's sigma over the bound, root mean square
  Ratio nees, gyro_drift_nees;  // per degree of freedom
  std::array<Ratio, control_names.size()> controls;  // high 0: not run; right is OUTSIDE
  int consistent = 0, inconsistent = 0, not_converged = 0;
  int most_passes = 0;
  double nis = 0.0, arw_ratio = 0.0, vrw_ratio = 0.0;  // means
  bool holds() const;
};

CaseReport evaluate(const std::string& name, const std::vector<Trial>& trials, const Limits& limits);
std::string text(const CaseReport& report);
nlohmann::ordered_json json(const CaseReport& report);

}  // namespace selfcal::monte_carlo
