// Section [hub] of selfcald.toml: a depot's memory, to which runs are sent (daemon/hub). Nothing of it is needed to calibrate.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "protocol/error.hpp"

namespace selfcal {

struct HubConfig {
  std::string connection;    // libpq connection string
  std::string recordings;    // shared folder; empty: recordings stay here
  double interval_s = 10.0;  // between looks at outbox and hub
};

// Of a configuration that parse_config (config.hpp) accepts; nothing where there is no such section.
Expected<std::optional<HubConfig>> load_hub_config(const std::string& file);

}  // namespace selfcal
