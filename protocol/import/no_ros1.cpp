// ROS 1's bags in a program that was built without their library.
#include <fmt/format.h>

#include "protocol/import/bag.hpp"

namespace selfcal::import {

Expected<Bag> read_ros1_bag(const std::filesystem::path& file) {
  return fail(ErrorKind::usage,
              fmt::format("{}: a ROS 1 bag, and this program was built without their library; `tools/setup programs` "
                          "builds it in; `rostopic echo -b FILE -p TOPIC` writes CSV, `rosbags-convert` a ROS 2 bag",
                          file.string()));
}

}  // namespace selfcal::import
