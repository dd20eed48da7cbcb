// The 24 coefficients to be pushed to an INS, with what is known about them.
#pragma once

#include <array>
#include <string>

#include "estimator/passes/calibration.hpp"
#include "protocol/error.hpp"

namespace selfcal {

struct CoefficientSet {
  std::string serial;                                  // of the INS they belong to
  std::string computed_at_utc;                         // ISO 8601
  std::array<double, sensor_parameter_count> value{};  // SI, order of sensor_parameters
  std::array<double, sensor_parameter_count> sigma{};  // SI
  std::array<bool, sensor_parameter_count> determined{};
  bool acceptable = false;  // the gate's answer: no objection
};

// A value outside what is physically possible counts as not determined here. The time is the caller's, who has a clock.
CoefficientSet coefficient_set(const CalibrationResult& result, bool acceptable, std::string serial,
                               std::string computed_at_utc);

// What the INS should hold for the parameters the recording determined, keeping `in_force` (SI) for all others: so
// that an undetermined value is never pushed.
std::array<double, sensor_parameter_count> merged_with_in_force(
    const CoefficientSet& set, const std::array<double, sensor_parameter_count>& in_force);

// JSON in the units of sensor_parameters; reading checks names, units and that every value is finite.
std::string coefficient_set_json(const CoefficientSet& set);
Expected<CoefficientSet> parse_coefficient_set(const std::string& json, const std::string& name);

}  // namespace selfcal
