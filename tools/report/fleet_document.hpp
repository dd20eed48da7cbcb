// All units: who is due, who drifts, by how much, and when a parameter will pass its limit.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "protocol/error.hpp"

namespace selfcal::report {

struct FleetOptions {
  double interval_days = 365.0;  // between calibrations
  std::string as_of_utc;         // the day that the page is of, ISO 8601
};

// `histories`: documents of the daemon, one per serial number. The straight lines are those of parameter_trend().
Expected<nlohmann::ordered_json> fleet_document(const std::vector<nlohmann::ordered_json>& histories,
                                                const FleetOptions& options);

}  // namespace selfcal::report
