// The page of all units from a depot's hub: what all sets measured, and what the fleet's model says of it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocol/error.hpp"
#include "tools/report/fleet_document.hpp"

namespace selfcal::cli {

// `hub`: connection string. Of each unit its last twelve calibrations; it is due, and passes a limit, when the model says so
// (selfcal fleet fit), and where there is none when the interval is over. An error (device) where the hub does not answer.
Expected<nlohmann::ordered_json> fleet_page_of_hub(const std::string& hub, const report::FleetOptions& options);

}  // namespace selfcal::cli
