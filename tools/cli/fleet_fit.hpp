// Fits the fleet's model to all certificates of a hub and stores what follows for each unit and each set.
#pragma once

#include "daemon/hub/hub_connection.hpp"

namespace selfcal::cli {

struct FitOptions {
  double risk = 0.01;              // that a unit leaves its limits before it is due
  double longest_years = 3.0;      // between calibrations
  double false_accusation = 0.01;  // of sound sets, a year
};

struct FitCounts {
  std::size_t certificates = 0, units = 0, types = 0, sets = 0;
  int accused = 0;
};

// One transaction; an error leaves the fit that was there.
Expected<FitCounts> fit_fleet(hub::Connection& connection, const FitOptions& options);

}  // namespace selfcal::cli
