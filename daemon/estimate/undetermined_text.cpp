#include "daemon/estimate/undetermined_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "daemon/estimate/quantity_text.hpp"

namespace selfcal {
namespace {

constexpr std::size_t most_columns = 100;
constexpr std::size_t told_singly = 4;  // directions; a fifth line says what to do

struct Group {
  int first, count;
  std::string_view name;
};
constexpr std::array<Group, 7> groups = {{{parameter::accel_bias, 3, "accel_bias"},
                                          {parameter::gyro_drift, 3, "gyro_drift"},
                                          {parameter::accel_scale_pos, 3, "accel_scale_pos"},
                                          {parameter::accel_scale_neg, 3, "accel_scale_neg"},
                                          {parameter::accel_misalignment, 3, "accel_misalignment"},
                                          {parameter::gyro_scale, 3, "gyro_scale"},
                                          {parameter::gyro_misalignment, 6, "gyro_misalignment"}}};

// "accel_bias" where the whole group is open, "accel_bias x z" where part of it is; empty where none.
std::string open_members(const CalibrationResult& result, const Group& group) {
  std::string members;
  int open = 0;
  for (int k = group.first; k < group.first + group.count; ++k) {
    if (!result.determined[static_cast<std::size_t>(k)]) {
      const std::string_view name = sensor_parameters[static_cast<std::size_t>(k)].name;
      members += fmt::format(" {}", name.substr(name.rfind('_') + 1));
      ++open;
    }
  }
  return open == 0 ? std::string() : fmt::format("{}{}", group.name, open == group.count ? std::string() : members);
}

// The parts of a direction, largest first, as far as the line has room for them.
std::string direction_line(std::string text, const UndeterminedDirection& direction) {
  std::array<int, sensor_parameter_count> order{};
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(direction.direction(a)) > std::abs(direction.direction(b)); });
  text += fmt::format("sigma {} tolerances along", number_text(direction.sigma));
  constexpr double counts = 0.3;  // a tenth of the direction's square
  for (const int k : order) {
    const std::string part =
        fmt::format(" {:+.2f} {}", direction.direction(k), sensor_parameters[static_cast<std::size_t>(k)].name);
    if (std::abs(direction.direction(k)) < counts || text.size() + part.size() > most_columns) {
      break;
    }
    text += part;
  }
  return text;
}

std::string remedy_line(const UndeterminedDirection& direction) {
  if (direction.supply.empty()) {
    return "  no single turn fixes it: longer dwells, or a schedule with more positions (selfcal plan)";
  }
  const SupplyingTurn& turn = direction.supply.front();
  return fmt::format("  a dwell at {:.0f}/{:.0f} and one at {:.0f}/{:.0f} deg (outer/inner) would take it to sigma {}",
                     turn.from.outer_deg, turn.from.inner_deg, turn.to.outer_deg, turn.to.inner_deg,
                     number_text(turn.sigma_after));
}

// The groups with open members, on two lines at most.
std::string open_groups(const CalibrationResult& result) {
  const auto open = std::count(result.determined.begin(), result.determined.end(), false);
  std::string text, line = fmt::format("undetermined: {} of {} parameters:", open, sensor_parameter_count);
  for (const Group& group : groups) {
    const std::string members = open_members(result, group);
    if (members.empty()) {
      continue;
    }
    if (line.size() + members.size() + 2 > most_columns) {
      text += line + "\n";
      line = "   ";
    }
    line += fmt::format(" {}{}", members, &group == &groups.back() ? "" : ";");
  }
  while (line.back() == ';' || line.back() == ' ') {
    line.pop_back();
  }
  return text + line + "\n";
}

}  // namespace

std::string undetermined_text(const CalibrationResult& result) {
  const std::vector<UndeterminedDirection>& all = result.undetermined;
  if (all.empty()) {
    return {};
  }
  std::string text;
  if (all.size() <= told_singly) {
    for (const UndeterminedDirection& direction : all) {
      text += direction_line("undetermined: ", direction) + "\n";
    }
  } else {
    text = open_groups(result) + direction_line("  the worst: ", all.front()) + "\n";
  }
  return text + remedy_line(all.front()) + "\n";
}

}  // namespace selfcal
