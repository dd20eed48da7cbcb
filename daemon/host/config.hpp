// selfcald.toml: every key, its default, and a strict reader (config/selfcald.toml documents the keys for people).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/geometry/sensor_parameters.hpp"
#include "protocol/error.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal {

struct InsConfig {
  InsConfig() = default;
  explicit InsConfig(profile::ProfilePtr which) : profile(std::move(which)) {}

  std::string name;       // the section's: [ins.NAME]
  std::string interface;  // CAN network interface
  // What the INS speaks. Keys of the section that say the same as the profile come before it.
  profile::ProfilePtr profile = profile::built_in();
  std::string profile_name = profile->name;  // as the section names it
  std::uint32_t request_id = profile->bus.request;
  std::uint32_t response_id = profile->bus.response;
  std::uint32_t functional_id = profile->bus.functional;
  std::optional<std::uint32_t> status_id =
      profile->bus.status;                        // of the state frame; the gimbal frame has the next one
  bool extended_ids = profile->bus.extended_ids;  // 29-bit identifiers
  bool fd = profile->bus.fd;                      // CAN FD frames with bit rate switch
  std::string key_file;  // SecurityAccess key, 16 bytes as 32 hex digits; empty: credential "NAME.key", then "ins.key"
  std::string schedule = "horizontal";
  double dwell_s = 150.0;
  double rotation_s = 5.0;
  double request_timeout_s = profile->timing.request_timeout_s;  // P2 client
  double lost_after_s = 30.0;                                    // link lost for longer: the run fails
  double running_estimate_s = 60.0;  // estimate anew while turning, after so much data more; 0: only at the end
  double drift_check_s = 300.0;      // free-inertial drift before and after; 0: not measured
  double time_scale = 1.0;           // the INS's clock runs so many times faster (virtual INS only)
  double latitude_deg = 0.0, longitude_deg = 0.0, height_m = 0.0;
  bool site_given = false;  // else the INS's own site is used
  // 1 sigma beyond which a parameter counts as not determined, and |value| beyond which it is implausible for this
  // type of INS; in the parameters' JSON units. Absent: the estimator's own.
  std::array<std::optional<double>, sensor_parameter_count> tolerance;
  std::array<std::optional<double>, sensor_parameter_count> limit;
};

struct Config {
  std::string state_directory = "/var/lib/selfcal";
  std::string bus = "system";                               // system, session, or a D-Bus address
  std::string lcm_url = "udpm://239.255.76.67:7667?ttl=0";  // empty: no LCM
  double recordings_quota_mib = 20000.0;
  double recordings_keep_days = 0.0;  // 0: for ever
  double free_space_mib = 256.0;      // a run is not started with less
  std::vector<InsConfig> instruments;

  const InsConfig* find(std::string_view name) const;
};

// All complaints at once, one per line: "FILE:LINE: key: what is wrong". A profile is looked for in the folder profiles beside
// `file`, or where its path says, from the folder of `file`.
Expected<Config> parse_config(std::string_view text, const std::string& file);
Expected<Config> load_config(const std::string& file);

// Every key that exists, as "section.key" ("ins.*.interface"), so that a test can hold the documentation to it.
std::vector<std::string> config_keys();

}  // namespace selfcal
