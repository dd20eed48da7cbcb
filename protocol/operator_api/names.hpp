// Names of the operator interface on D-Bus. The interfaces themselves are the two XML files beside this one.
#pragma once

#include <string>
#include <string_view>

namespace selfcal::operator_api {

inline constexpr const char* bus_name = "org.selfcal.Manager1";
inline constexpr const char* manager_path = "/org/selfcal/Manager";

// `ins`: name of its section in selfcald.toml (a-z, 0-9, _: all allowed in an object path).
inline std::string ins_path(std::string_view ins) { return "/org/selfcal/ins/" + std::string(ins); }

// Environment variable that selects the bus: "system", "session", or an address. It outranks the configuration.
inline constexpr const char* bus_variable = "SELFCAL_BUS";

// D-Bus errors.
inline constexpr const char* error_busy = "org.selfcal.Error.Busy";                // another run has this INS
inline constexpr const char* error_unknown = "org.selfcal.Error.Unknown";          // no such INS, run or option
inline constexpr const char* error_unavailable = "org.selfcal.Error.Unavailable";  // disk, database, key
inline constexpr const char* error_nothing = "org.selfcal.Error.NothingToDo";      // no run to abort, no set to restore

}  // namespace selfcal::operator_api
