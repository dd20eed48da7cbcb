#include "protocol/import/bag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

namespace selfcal::import {
namespace {

constexpr std::size_t most_joints = 64;
constexpr std::size_t longest_name = 256;
constexpr std::uint32_t second_ns = 1000000000;

// A run of numbers of a message, behind its header. Three are x, y and z. A covariance whose first number is -1 says that
// the run before it was not measured.
struct Run {
  std::string_view field;  // empty: skipped
  std::size_t count;
  std::string_view unit;
  bool covariance = false;
};
constexpr std::array<Run, 6> imu{{{"", 4, ""},
                                  {"", 9, ""},
                                  {"angular_velocity", 3, "rad/s"},
                                  {"", 9, "", true},
                                  {"linear_acceleration", 3, "m/s^2"},
                                  {"", 9, "", true}}};
constexpr std::array<Run, 1> vector3{{{"vector", 3, ""}}};
constexpr std::array<Run, 2> temperature{{{"temperature", 1, "C"}, {"", 1, ""}}};

struct Layout {
  std::string_view type;
  std::span<const Run> runs;  // none: names and positions of joints
};
constexpr std::array<Layout, 4> layouts{{{"sensor_msgs/Imu", imu},
                                         {"geometry_msgs/Vector3Stamped", vector3},
                                         {"sensor_msgs/Temperature", temperature},
                                         {"sensor_msgs/JointState", {}}}};

bool printable(std::string_view name) {
  return !name.empty() && name.size() <= longest_name &&
         std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c <= '~'; });
}

template <typename Number>
void take_in_order(const std::vector<std::size_t>& order, std::vector<Number>& values) {
  std::vector<Number> ordered;
  ordered.reserve(values.size());
  for (const std::size_t k : order) {
    ordered.push_back(values[k]);
  }
  values = std::move(ordered);
}

// Within one time of reception as they stood in the file.
void put_in_order(Series& series) {
  const std::vector<std::int64_t>& received = series.received_ns;
  if (std::is_sorted(received.begin(), received.end())) {
    return;
  }
  std::vector<std::size_t> order(received.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&received](std::size_t a, std::size_t b) { return received[a] < received[b]; });
  take_in_order(order, series.stamp_ns);
  for (std::vector<double>& values : series.values) {
    take_in_order(order, values);
  }
  std::sort(series.received_ns.begin(), series.received_ns.end());
}

// Nanoseconds since 1970. ROS 1 counts its messages before that.
std::int64_t read_header(MessageReader& reader, Encoding encoding, std::string& fault) {
  std::int64_t seconds = 0;
  if (encoding == Encoding::ros1) {
    reader.u32();
    seconds = reader.u32();
  } else {
    seconds = static_cast<std::int32_t>(reader.u32());
  }
  const std::uint32_t nanoseconds = reader.u32();
  reader.text();
  if (nanoseconds >= second_ns && reader.fault().empty()) {
    fault = fmt::format("stamp of {} s and {} ns; less than {} ns are expected", seconds, nanoseconds, second_ns);
  }
  return seconds * second_ns + nanoseconds;
}

}  // namespace

BagBuilder::BagBuilder(std::string file, std::string form, Encoding encoding)
    : file_(std::move(file)), encoding_(encoding) {
  bag_.form = std::move(form);
}

Expected<std::size_t> BagBuilder::topic(const std::string& name, std::string type) {
  constexpr std::string_view of_ros2 = "/msg";
  if (const std::size_t at = type.find("/msg/"); at != std::string::npos) {
    type.erase(at, of_ros2.size());
  }
  if (!printable(name) || !printable(type)) {
    return fail(ErrorKind::bad_input, fmt::format("{}: name or type of topic {} is no word of at most {} letters",
                                                  file_, topics_.size() + 1, longest_name));
  }
  const auto same = std::find_if(topics_.begin(), topics_.end(),
                                 [&](const Topic& topic) { return topic.name == name && topic.type == type; });
  if (same != topics_.end()) {
    return static_cast<std::size_t>(same - topics_.begin());
  }
  const auto layout =
      std::find_if(layouts.begin(), layouts.end(), [&type](const Layout& known) { return known.type == type; });
  Topic& added = topics_.emplace_back();
  added.name = name;
  added.type = type;
  added.layout = layout == layouts.end() ? -1 : static_cast<int>(layout - layouts.begin());
  const auto rival = std::find_if(topics_.begin(), topics_.end() - 1, [&](const Topic& topic) {
    return topic.name == name && topic.layout >= 0 && added.layout >= 0;
  });
  if (rival != topics_.end() - 1) {
    return fail(ErrorKind::bad_input, fmt::format("{}: {} is of type {} and of {}", file_, name, rival->type, type));
  }
  if (added.layout < 0) {
    bag_.not_read.push_back(fmt::format("{} ({})", name, type));
  }
  return topics_.size() - 1;
}

Series& BagBuilder::series_of(Topic& topic, std::string_view joint) {
  const auto found = topic.series.find(joint);
  if (found != topic.series.end()) {
    return bag_.series[found->second];
  }
  topic.series.emplace(joint, bag_.series.size());
  Series& series = bag_.series.emplace_back();
  series.topic = topic.name;
  series.type = topic.type;
  if (!joint.empty()) {
    series.fields.push_back(fmt::format("position.{}", joint));
    series.units.emplace_back("rad");
  }
  for (const Run& run : layouts[static_cast<std::size_t>(topic.layout)].runs) {
    for (std::size_t k = 0; k < run.count && !run.field.empty(); ++k) {
      series.fields.push_back(run.count == 3 ? fmt::format("{}.{}", run.field, "xyz"[k]) : std::string(run.field));
      series.units.emplace_back(run.unit);
    }
  }
  series.values.resize(series.fields.size());
  return series;
}

void BagBuilder::read_fields(Topic& topic, const Times& times, MessageReader& reader) {
  Series& series = series_of(topic, {});
  std::size_t column = 0;
  for (const Run& run : layouts[static_cast<std::size_t>(topic.layout)].runs) {
    if (!run.field.empty()) {
      for (std::size_t k = 0; k < run.count; ++k) {
        series.values[column++].push_back(reader.f64());
      }
      continue;
    }
    const bool measured = !run.covariance || reader.f64() != -1.0;
    reader.skip_f64(run.count - (run.covariance ? 1 : 0));
    for (std::size_t k = column - 3; !measured && k < column; ++k) {
      series.values[k].back() = std::numeric_limits<double>::quiet_NaN();
    }
  }
  series.received_ns.push_back(times.received_ns);
  series.stamp_ns.push_back(times.stamp_ns);
}

// Names, positions, velocities, efforts; a topic may tell of other joints with each message.
std::string BagBuilder::read_joints(Topic& topic, const Times& times, MessageReader& reader) {
  constexpr std::size_t least_text = 4;
  std::vector<std::string_view> names(reader.count(least_text));
  for (std::string_view& name : names) {
    name = reader.text();
  }
  const std::uint32_t positions = reader.count(sizeof(double));
  if (reader.fault().empty() && positions != names.size() && positions != 0) {
    return fmt::format("{} positions of {} joints", positions, names.size());
  }
  for (std::size_t k = 0; k < positions && reader.fault().empty(); ++k) {
    if (!printable(names[k])) {
      return fmt::format("the name of joint {} is no word of at most {} letters", k + 1, longest_name);
    }
    Series& series = series_of(topic, names[k]);
    series.values.front().push_back(reader.f64());
    series.received_ns.push_back(times.received_ns);
    series.stamp_ns.push_back(times.stamp_ns);
    if (topic.series.size() > most_joints) {
      return fmt::format("more than {} joints", most_joints);
    }
  }
  for (int k = 0; k < 2; ++k) {
    reader.skip_f64(reader.count(sizeof(double)));
  }
  return {};
}

Expected<void> BagBuilder::message(std::size_t topic, std::int64_t received_ns, std::string_view bytes) {
  Topic& to = topics_[topic];
  ++to.messages;
  MessageReader reader(bytes, encoding_);
  std::string fault;
  const Times times{received_ns, read_header(reader, encoding_, fault)};
  if (fault.empty() && reader.fault().empty()) {
    if (layouts[static_cast<std::size_t>(to.layout)].runs.empty()) {
      fault = read_joints(to, times, reader);
    } else {
      read_fields(to, times, reader);
    }
    if (fault.empty()) {
      reader.end();
    }
  }
  fault = reader.fault().empty() ? fault : reader.fault();
  if (!fault.empty()) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}: message {} is no {}: {}", file_, to.name, to.messages, to.type, fault));
  }
  return {};
}

Bag BagBuilder::finish() {
  for (Series& series : bag_.series) {
    put_in_order(series);
  }
  return std::move(bag_);
}

}  // namespace selfcal::import
