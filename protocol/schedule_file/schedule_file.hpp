// Rotation schedules as people write them: TOML.
//
//   positions = [[0, 0], [90, 0], [180, 0]]   # outer, inner, degrees
//   dwell_s = 150                             # or one per position: [150, 60, 60]
//   rotation_s = 5
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/geometry/schedule.hpp"
#include "protocol/error.hpp"

namespace selfcal {

// What every program takes where no schedule is given.
inline constexpr std::string_view default_schedule = "horizontal";

// Limits of what is accepted; outside them a schedule is refused (bad_input) with key, index and value.
inline constexpr std::size_t max_schedule_positions = 255;
inline constexpr double max_dwell_s = 86400.0;
inline constexpr double max_rotation_s = 3600.0;

// `name` is what messages call the text (the file's name).
Expected<Schedule> parse_schedule(std::string_view toml, const std::string& name);
Expected<Schedule> read_schedule(const std::filesystem::path& path);
std::string format_schedule(const Schedule& schedule);

// NAME or FILE as on the command line: a named schedule (table2, horizontal) with the given timing, else a file.
// Where timing is given it replaces the file's.
Expected<Schedule> find_schedule(const std::string& name_or_file, std::optional<double> dwell_s = std::nullopt,
                                 std::optional<double> rotation_s = std::nullopt);

}  // namespace selfcal
