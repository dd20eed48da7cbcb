#include "protocol/profile/turning.hpp"

#include <array>
#include <string_view>

#include "protocol/profile/profile_file.hpp"

namespace selfcal::profile {
namespace {

constexpr double radians_per_degree = 3.14159265358979323846 / 180.0;
constexpr std::array<std::string_view, 2> ends{"angle", "state"};

}  // namespace

Turning read_turning(Section& section) {
  Turning turning;
  turning.by_angle = section.word("there", ends, section.there()).value_or("angle") == "angle";
  const bool needed = section.there() && turning.by_angle;
  turning.tolerance_rad = section.number("tolerance_deg", 0.001, 10.0, needed).value_or(1.0) * radians_per_degree;
  turning.rest_rad = section.number("rest_deg", 0.001, 5.0).value_or(0.05) * radians_per_degree;
  turning.longest_move_s = section.number("longest_s", 0.1, 3600.0).value_or(turning.longest_move_s);
  return turning;
}

}  // namespace selfcal::profile
