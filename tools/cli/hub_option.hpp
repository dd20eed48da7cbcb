// Which hub a command asks.
#pragma once

#include <cstdlib>
#include <string>

namespace selfcal::cli {

inline constexpr const char* hub_help = "connection string of libpq; else SELFCAL_HUB, else dbname=selfcal";

// What was given, or the environment's; libpq's own defaults and PG* variables fill in what it does not say.
inline std::string hub_connection_string(const std::string& given) {
  const char* text = std::getenv("SELFCAL_HUB");
  return !given.empty() ? given : text != nullptr ? text : "dbname=selfcal";
}

}  // namespace selfcal::cli
