// The numbers of a ROS bag: the messages of each topic whose type is known, as series.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/import/column_source.hpp"
#include "protocol/import/message_reader.hpp"

namespace selfcal::import {

// The messages of a topic, or the positions of one joint of it, in the order in which they were received.
struct Series {
  std::string topic;
  std::string type;  // "sensor_msgs/Imu", of ROS 1 and 2
  std::vector<std::string> fields;
  std::vector<std::string> units;
  std::vector<std::int64_t> received_ns;
  std::vector<std::int64_t> stamp_ns;       // of the header, since 1970
  std::vector<std::vector<double>> values;  // by field

  bool is_imu() const { return type == "sensor_msgs/Imu"; }
};

struct Bag {
  std::string form;  // "ROS 2 bag (SQLite)"
  std::vector<Series> series;
  std::vector<std::string> not_read;  // "/camera (sensor_msgs/Image)"
};

// Messages in any order to a bag. Imu, Vector3Stamped, Temperature and JointState are read; all others are named only.
class BagBuilder {
 public:
  BagBuilder(std::string file, std::string form, Encoding encoding);

  // The number by which message() knows the topic. Two topics of one name and type are one.
  Expected<std::size_t> topic(const std::string& name, std::string type);
  bool wanted(std::size_t topic) const { return topics_[topic].layout >= 0; }
  // Errors name file, topic, the message's number and what does not fit.
  Expected<void> message(std::size_t topic, std::int64_t received_ns, std::string_view bytes);
  Bag finish();

 private:
  struct Topic {
    std::string name;
    std::string type;
    int layout = -1;  // -1: not read
    std::size_t messages = 0;
    std::map<std::string, std::size_t, std::less<>> series;  // by joint; "" where there are none
  };
  struct Times {
    std::int64_t received_ns;
    std::int64_t stamp_ns;
  };
  Series& series_of(Topic& topic, std::string_view joint);
  void read_fields(Topic& topic, const Times& times, MessageReader& reader);
  // What does not fit; empty: nothing.
  std::string read_joints(Topic& topic, const Times& times, MessageReader& reader);

  std::string file_;
  Encoding encoding_;
  Bag bag_;
  std::vector<Topic> topics_;
};

// Columns "/topic.field" of all series. Rows are the messages of a topic of Imu; what other topics tell is put beside them by
// its stamps, between two of them linearly. With TOPIC those of that Imu alone; empty where there is but one.
Expected<std::unique_ptr<ColumnSource>> bag_source(Bag bag, const std::string& file,
                                                   const std::optional<std::string>& topic);

// rosbag2 with SQLite storage.
Expected<Bag> read_sqlite_bag(const std::filesystem::path& file);
// ROS 1, version 2.0.
Expected<Bag> read_ros1_bag(const std::filesystem::path& file);

}  // namespace selfcal::import
