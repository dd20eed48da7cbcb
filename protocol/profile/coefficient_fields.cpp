#include "protocol/profile/coefficient_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>

#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal::profile {
namespace {

struct Group {
  std::string_view name, unit, elements, meaning;
  Span span;
};
constexpr std::size_t plus = parameter::accel_scale_pos;
const std::array<Group, 8> groups{{
    {"accel_bias", "m/s^2", "x y z", "bias of the accelerometers", {parameter::accel_bias, 3}},
    {"gyro_drift", "rad/s", "x y z", "drift of the gyros", {parameter::gyro_drift, 3}},
    {"accel_scale_pos", "1", "x y z", "K+, times max(f, 0)", {plus, 3}},
    {"accel_scale_neg", "1", "x y z", "K-, times max(-f, 0)", {parameter::accel_scale_neg, 3}},
    {"accel_misalignment", "rad", "yx zx zy", "A", {parameter::accel_misalignment, 3}},
    {"gyro_scale", "1", "x y z", "K_G", {parameter::gyro_scale, 3}},
    {"gyro_misalignment", "rad", "xy xz yx yz zx zy", "G", {parameter::gyro_misalignment, 6}},
    {"accel_scale", "1", "x y z", "one factor in place of K+ and K-", {plus, 3, true}},
}};

std::vector<RoleField> fields_of_sets() {
  static std::deque<std::string> names;
  const auto own = record_role("coefficients").fields;
  std::vector<RoleField> fields(own.begin(), own.end());
  for (const Group& group : groups) {
    fields.push_back({group.name, group.unit, false, group.meaning, {}, group.span.count});
    std::string_view rest = group.elements;
    while (!rest.empty()) {
      const std::string_view element = rest.substr(0, rest.find(' '));
      rest.remove_prefix(std::min(rest.size(), element.size() + 1));
      fields.push_back(
          {names.emplace_back(fmt::format("{}_{}", group.name, element)), group.unit, false, group.meaning});
    }
  }
  return fields;
}

}  // namespace

const RecordRole& set_role() {
  static const std::vector<RoleField> fields = fields_of_sets();
  static const RecordRole role{"coefficients", record_role("coefficients").meaning, fields};
  return role;
}

std::optional<Span> span_of(std::string_view field) {
  if (field == "values") {
    return Span{0, ins::coefficient_count};
  }
  for (const Group& group : groups) {
    if (field == group.name) {
      return group.span;
    }
    if (field.starts_with(group.name) && field.size() > group.name.size() && field[group.name.size()] == '_') {
      std::string_view rest = group.elements;
      for (std::size_t k = 0; !rest.empty(); ++k) {
        const std::string_view element = rest.substr(0, rest.find(' '));
        if (field.substr(group.name.size() + 1) == element) {
          return Span{group.span.first + k, 1, group.span.one_factor};
        }
        rest.remove_prefix(std::min(rest.size(), element.size() + 1));
      }
    }
  }
  return std::nullopt;
}

Factor factor_of(std::string_view field) {
  const auto span = span_of(field);
  if (!span || field == "values") {
    return Factor::none;
  }
  if (span->first >= parameter::accel_scale_neg && span->first < parameter::accel_misalignment) {
    return Factor::negative_slope;
  }
  const bool accel = span->first >= plus && span->first < parameter::accel_scale_neg;
  const bool gyro = span->first >= parameter::gyro_scale && span->first < parameter::gyro_misalignment;
  return accel || gyro ? Factor::slope : Factor::none;
}

std::vector<std::string> coefficient_complaints(const Layout& layout) {
  std::array<std::vector<std::string>, ins::coefficient_count> named;
  for (const Field& field : layout.fields) {
    if (const auto span = span_of(field.name); span && !field.constant) {
      for (std::size_t k = span->first; k < span->first + span->count; ++k) {
        named[k].push_back(field.name);
        if (span->one_factor) {
          named[k + 3].push_back(field.name);
        }
      }
    }
  }
  std::vector<std::string> complaints;
  for (std::size_t k = 0; k < named.size(); ++k) {
    if (named[k].empty()) {
      complaints.push_back(fmt::format("{} is missing", ins::coefficient_names[k]));
    } else if (named[k].size() > 1) {
      complaints.push_back(fmt::format("{} is told by {}", ins::coefficient_names[k], fmt::join(named[k], " and ")));
    }
  }
  return complaints;
}

}  // namespace selfcal::profile
