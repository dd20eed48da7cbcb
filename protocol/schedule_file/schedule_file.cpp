#include "protocol/schedule_file/schedule_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>

#include "protocol/recording/atomic_file.hpp"
#include "protocol/toml_file/nearest_word.hpp"
#include "protocol/toml_file/toml_file.hpp"

namespace selfcal {
namespace {

// Two turns either way: no gimbal of ours turns further, and the cosine of a slip like 27000 would not show.
constexpr double max_angle_deg = 720.0;

constexpr std::array<std::string_view, 2> schedule_names = {"horizontal", "table2"};

Expected<void> check_positions(const TomlFile& file, const std::vector<std::array<double, 2>>& positions) {
  if (positions.empty() || positions.size() > max_schedule_positions) {
    return tl::unexpected(file.error_at(
        "positions", fmt::format("{} positions, 1 to {} allowed", positions.size(), max_schedule_positions)));
  }
  for (std::size_t k = 0; k < positions.size(); ++k) {
    for (const double angle : positions[k]) {
      if (std::abs(angle) > max_angle_deg) {
        return tl::unexpected(file.error_at(
            "positions", fmt::format("position {}: {} deg is outside +-{} deg", k, angle, max_angle_deg)));
      }
    }
  }
  return {};
}

Expected<std::vector<double>> read_dwells(const TomlFile& file, std::size_t positions) {
  Expected<std::vector<double>> dwells =
      file.is_array("dwell_s")
          ? file.numbers("dwell_s")
          : file.number("dwell_s").map([&](double dwell) { return std::vector<double>(positions, dwell); });
  if (!dwells) {
    return dwells;
  }
  if (dwells->size() != positions) {
    return tl::unexpected(
        file.error_at("dwell_s", fmt::format("{} dwells for {} positions", dwells->size(), positions)));
  }
  for (const double dwell : *dwells) {
    if (!(dwell > 0.0) || dwell > max_dwell_s) {
      return tl::unexpected(file.error_at("dwell_s", fmt::format("{} s is outside (0, {}] s", dwell, max_dwell_s)));
    }
  }
  return dwells;
}

Expected<double> checked_time(double value, double limit, std::string_view key) {
  if (!(value > 0.0) || value > limit) {
    return fail(ErrorKind::usage, fmt::format("{}: {} s is outside (0, {}] s", key, value, limit));
  }
  return value;
}

}  // namespace

Expected<Schedule> parse_schedule(std::string_view toml, const std::string& name) {
  const Expected<TomlFile> file = TomlFile::parse(toml, name);
  if (!file) {
    return tl::unexpected(file.error());
  }
  if (const auto known = file->only({"positions", "dwell_s", "rotation_s", "name"}); !known) {
    return tl::unexpected(known.error());
  }
  const auto positions = file->pairs("positions");
  if (!positions) {
    return tl::unexpected(positions.error());
  }
  if (const auto sound = check_positions(*file, *positions); !sound) {
    return tl::unexpected(sound.error());
  }
  auto dwells = read_dwells(*file, positions->size());
  if (!dwells) {
    return tl::unexpected(dwells.error());
  }
  Schedule schedule;
  for (const auto& [outer, inner] : *positions) {
    schedule.positions.push_back({outer, inner});
  }
  schedule.dwell_s = std::move(*dwells);
  const auto rotation = file->optional_number("rotation_s");
  if (!rotation) {
    return tl::unexpected(rotation.error());
  }
  schedule.rotation_s = rotation->value_or(schedule.rotation_s);
  if (!(schedule.rotation_s > 0.0) || schedule.rotation_s > max_rotation_s) {
    return tl::unexpected(
        file->error_at("rotation_s", fmt::format("{} s is outside (0, {}] s", schedule.rotation_s, max_rotation_s)));
  }
  return schedule;
}

Expected<Schedule> read_schedule(const std::filesystem::path& path) {
  constexpr std::size_t longest = 1 << 20;
  const Expected<std::string> text = read_text_file(path, longest);
  if (!text) {
    return tl::unexpected(text.error());
  }
  return parse_schedule(*text, path.string());
}

std::string format_schedule(const Schedule& schedule) {
  std::string text = "# outer, inner, degrees\npositions = [\n";
  for (const GimbalPosition& position : schedule.positions) {
    text += fmt::format("  [{}, {}],\n", position.outer_deg, position.inner_deg);
  }
  text += fmt::format("]\ndwell_s = [{}]\nrotation_s = {}\n", fmt::join(schedule.dwell_s, ", "), schedule.rotation_s);
  return text;
}

Expected<Schedule> find_schedule(const std::string& name_or_file, std::optional<double> dwell_s,
                                 std::optional<double> rotation_s) {
  Schedule schedule;
  if (auto named = named_schedule(name_or_file)) {
    schedule = std::move(*named);
  } else {
    std::error_code ignored;
    if (!std::filesystem::exists(name_or_file, ignored)) {
      return fail(ErrorKind::usage,
                  fmt::format("schedule {}: neither a file nor one of {}{}", name_or_file,
                              fmt::join(schedule_names, ", "), did_you_mean(name_or_file, schedule_names)));
    }
    auto read = read_schedule(name_or_file);
    if (!read) {
      return read;
    }
    schedule = std::move(*read);
  }
  if (dwell_s) {
    if (const auto sound = checked_time(*dwell_s, max_dwell_s, "dwell"); !sound) {
      return tl::unexpected(sound.error());
    }
    schedule.dwell_s.assign(schedule.positions.size(), *dwell_s);
  }
  if (rotation_s) {
    if (const auto sound = checked_time(*rotation_s, max_rotation_s, "rotation"); !sound) {
      return tl::unexpected(sound.error());
    }
    schedule.rotation_s = *rotation_s;
  }
  return schedule;
}

}  // namespace selfcal
