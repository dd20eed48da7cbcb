// Any bytes as messages of a ROS bag: no crash, one line that says what is wrong, and series whose columns are equally long
// and no longer than the bytes. The first byte chooses type and encoding, then a length and a message follow each other.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "protocol/import/bag.hpp"

namespace selfcal::import {
namespace {

void must(bool condition) {
  if (!condition) {
    std::abort();
  }
}

void check(const Bag& bag, std::size_t size) {
  for (const Series& series : bag.series) {
    must(series.values.size() == series.fields.size() && series.fields.size() == series.units.size());
    must(series.received_ns.size() == series.stamp_ns.size() && series.stamp_ns.size() <= size);
    for (const std::vector<double>& values : series.values) {
      must(values.size() == series.stamp_ns.size());
    }
  }
}

}  // namespace
}  // namespace selfcal::import

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace selfcal::import;
  static constexpr const char* types[] = {"sensor_msgs/msg/Imu", "geometry_msgs/msg/Vector3Stamped",
                                          "sensor_msgs/msg/Temperature", "sensor_msgs/msg/JointState"};
  if (size == 0) {
    return 0;
  }
  BagBuilder builder("fuzz.bag", "bag", (data[0] & 4U) != 0 ? Encoding::ros1 : Encoding::cdr);
  const auto topic = builder.topic("/t", types[data[0] % 4U]);
  must(topic && builder.wanted(*topic));
  std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  for (std::int64_t received = 0; !rest.empty(); ++received) {
    const std::size_t length = 2 * static_cast<std::uint8_t>(rest.front());
    const std::string_view message = rest.substr(1, length);
    rest.remove_prefix(1 + message.size());
    if (const auto taken = builder.message(*topic, received % 3, message); !taken) {
      must(!taken.error().message.empty() && taken.error().message.find('\n') == std::string::npos);
      return 0;
    }
  }
  check(builder.finish(), size);
  return 0;
}
