#include "tools/cli/log_units.hpp"

#include <algorithm>
#include <regex>
#include <string>

#include "estimator/geometry/units.hpp"

namespace selfcal::cli {

double unit_of(const std::vector<import::NamedColumn>& named, const std::vector<std::size_t>& columns,
               import::Quantity quantity) {
  if (columns.empty()) {
    return 0.0;
  }
  std::string said;  // some say it once: "gx (dps), gy, gz"
  for (const std::size_t column : columns) {
    const std::string& unit = named[column].unit;
    if (!unit.empty() && !said.empty() && unit != said) {
      return 0.0;
    }
    said = unit.empty() ? said : unit;
  }
  auto unit = import::find_unit(said);
  if (unit && quantity == import::Quantity::angular_rate && unit->quantity == import::Quantity::angle &&
      !named[columns.front()].increment) {
    unit = import::find_unit(said + "/s");
  }
  return unit && unit->quantity == quantity ? unit->si : 0.0;
}

std::size_t named_temperature(const std::vector<import::NamedColumn>& named) {
  const auto is = [](const import::NamedColumn& c) { return c.role == import::Role::temperature; };
  const auto found = std::find_if(named.begin(), named.end(), is);
  return std::count_if(named.begin(), named.end(), is) == 1 ? static_cast<std::size_t>(found - named.begin()) + 1 : 0;
}

double unit_of_angle(const import::NamedColumn& column) {
  const auto unit = import::find_unit(column.unit);
  return unit && unit->quantity == import::Quantity::angle ? unit->si : units::degree;
}

bool called_angle(const import::NamedColumn& column, const std::string& name) {
  static const std::regex angle("angle|winkel|theta|tilt", std::regex::icase);
  const auto unit = import::find_unit(column.unit);
  return unit ? unit->quantity == import::Quantity::angle
              : std::regex_search(name, angle) || column.role == import::Role::outer ||
                    column.role == import::Role::inner || column.role == import::Role::gimbal;
}

}  // namespace selfcal::cli
