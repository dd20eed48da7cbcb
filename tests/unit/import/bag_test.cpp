// ROS bags: messages from literal bytes in both encodings, SQLite files of the test's own making, what is hostile.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include "protocol/import/bag.hpp"
#include "protocol/import/build_recording.hpp"
#include "protocol/import/guess.hpp"
#include "tests/unit/recording/sample_recording.hpp"

namespace selfcal::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string bytes(std::initializer_list<int> all) {
  std::string out;
  for (const int one : all) {
    out += static_cast<char>(one);
  }
  return out;
}

// CDR by its rules: every number at a multiple of its size behind the four bytes of the encapsulation.
class Cdr {
 public:
  explicit Cdr(bool little = true) : little_(little), bytes_(bytes({0, little ? 1 : 0, 0, 0})) {}
  template <typename Number>
  Cdr& put(Number number) {
    bytes_.resize(4 + (bytes_.size() - 4 + sizeof number - 1) / sizeof number * sizeof number, '\0');
    std::string raw(reinterpret_cast<const char*>(&number), sizeof number);
    if (little_ != (std::endian::native == std::endian::little)) {
      std::reverse(raw.begin(), raw.end());
    }
    bytes_ += raw;
    return *this;
  }
  Cdr& text(const std::string& words) {
    put(static_cast<std::uint32_t>(words.size() + 1));
    bytes_ += words + '\0';
    return *this;
  }
  Cdr& header(std::int32_t seconds, std::uint32_t nanoseconds, const std::string& frame) {
    return put(seconds).put(nanoseconds).text(frame);
  }
  const std::string& bytes_so_far() const { return bytes_; }

 private:
  bool little_;
  std::string bytes_;
};

// Gyros k, k + 0.25, k + 0.5; accelerometers 9, 10 + k, 11; everything else is -7, which no column may show.
std::string imu(std::int32_t seconds, std::uint32_t nanoseconds, double k, bool little = true,
                const std::string& frame = "imu_link") {
  Cdr message(little);
  message.header(seconds, nanoseconds, frame);
  const auto strangers = [&message](int count) {
    for (int n = 0; n < count; ++n) {
      message.put(-7.0);
    }
  };
  strangers(13);
  message.put(k).put(k + 0.25).put(k + 0.5);
  strangers(9);
  message.put(9.0).put(10.0 + k).put(11.0);
  strangers(9);
  return message.bytes_so_far();
}

class Messages : public ::testing::Test {
 protected:
  Expected<Bag> bag_of(const std::string& type, std::initializer_list<std::string> messages,
                       Encoding encoding = Encoding::cdr) {
    BagBuilder builder("file", "bag", encoding);
    const auto topic = builder.topic("/t", type);
    std::int64_t received = 0;
    for (const std::string& message : messages) {
      if (const auto taken = builder.message(*topic, ++received, message); !taken) {
        return tl::unexpected(taken.error());
      }
    }
    return builder.finish();
  }
  std::string fault(const std::string& type, const std::string& message, Encoding encoding = Encoding::cdr) {
    const auto bag = bag_of(type, {message}, encoding);
    return bag ? std::string() : bag.error().message;
  }
};

// 1.0 is 3FF0000000000000, 1.5 is 3FF8000000000000, -2.0 is C000000000000000. A frame of two letters ends at byte 15 behind
// the encapsulation; one byte is left out before the doubles.
TEST_F(Messages, CdrOfLiteralBytes) {
  const std::string little =
      bytes({0x00, 0x01, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01, 0xCA, 0x9A, 0x3B, 0x03, 0x00, 0x00,
             0x00, 'i',  'm',  0x00, 0xEE, 0,    0,    0,    0,    0,    0,    0xF0, 0x3F, 0,    0,
             0,    0,    0,    0,    0xF8, 0x3F, 0,    0,    0,    0,    0,    0,    0x00, 0xC0});
  const std::string big =
      bytes({0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x3B, 0x9A, 0xC9, 0xFF, 0x00, 0x00, 0x00,
             0x03, 'i',  'm',  0x00, 0xEE, 0x3F, 0xF0, 0,    0,    0,    0,    0,    0,    0x3F, 0xF8,
             0,    0,    0,    0,    0,    0,    0xC0, 0x00, 0,    0,    0,    0,    0,    0});
  std::string sound = little;
  sound[8] = '\xFF';
  sound[9] = '\xC9';  // 999999999
  const auto bag = bag_of("geometry_msgs/msg/Vector3Stamped", {sound, big});
  ASSERT_TRUE(bag) << bag.error().message;
  const Series& series = bag->series.front();
  EXPECT_THAT(series.fields, ElementsAre("vector.x", "vector.y", "vector.z"));
  EXPECT_THAT(series.stamp_ns, ElementsAre(2999999999, 2999999999));
  EXPECT_THAT(series.values[0], ElementsAre(1.0, 1.0));
  EXPECT_THAT(series.values[1], ElementsAre(1.5, 1.5));
  EXPECT_THAT(series.values[2], ElementsAre(-2.0, -2.0));
  EXPECT_THAT(fault("geometry_msgs/msg/Vector3Stamped", little), HasSubstr("stamp of 2 s and 1000000001 ns"));
}

TEST_F(Messages, ImuInBothOrdersAndWithAnyFrame) {
  for (const bool little : {true, false}) {
    for (const char* frame : {"", "a", "ab", "abc", "abcd", "abcde", "abcdef", "abcdefg"}) {
      const auto bag = bag_of("sensor_msgs/msg/Imu", {imu(1709164800, 1, 0.1, little, frame)});
      ASSERT_TRUE(bag) << bag.error().message;
      const Series& series = bag->series.front();
      EXPECT_EQ(series.stamp_ns.front(), 1709164800000000001);
      std::vector<double> first;
      for (const auto& values : series.values) {
        first.push_back(values.front());
      }
      EXPECT_THAT(first, ElementsAre(0.1, 0.1 + 0.25, 0.1 + 0.5, 9.0, 10.1, 11.0));
      EXPECT_THAT(series.units, ElementsAre("rad/s", "rad/s", "rad/s", "m/s^2", "m/s^2", "m/s^2"));
    }
  }
}

TEST_F(Messages, Ros1IsPacked) {
  std::string message = bytes({9, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0, 'i'});
  for (const double number : {21.5, 0.25}) {
    message.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  const auto bag = bag_of("sensor_msgs/Temperature", {message}, Encoding::ros1);
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_THAT(bag->series.front().stamp_ns, ElementsAre(2000000003));
  EXPECT_THAT(bag->series.front().values, ElementsAre(ElementsAre(21.5)));
  EXPECT_THAT(fault("sensor_msgs/Temperature", message + "x", Encoding::ros1),
              HasSubstr("message 1 is no sensor_msgs/Temperature: 34 bytes; the message ends behind 33"));
}

// sensor_msgs/Imu: "if you have no estimate for one of the data elements, set element 0 of its covariance to -1".
TEST_F(Messages, WhatWasNotMeasuredIsNoNumber) {
  Cdr message;
  message.header(1, 0, "");
  for (int k = 0; k < 37; ++k) {
    message.put(k == 16 ? -1.0 : 0.5);  // 4 + 9 + 3 numbers stand before the covariance of the rates
  }
  const auto bag = bag_of("sensor_msgs/msg/Imu", {message.bytes_so_far()});
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_TRUE(std::isnan(bag->series.front().values[1].front()));
  EXPECT_EQ(bag->series.front().values[3].front(), 0.5);
}

TEST_F(Messages, JointsByName) {
  const auto state = [](std::initializer_list<const char*> names, std::initializer_list<double> positions) {
    Cdr message;
    message.header(5, 0, "");
    message.put(static_cast<std::uint32_t>(names.size()));
    for (const char* name : names) {
      message.text(name);
    }
    message.put(static_cast<std::uint32_t>(positions.size()));
    for (const double position : positions) {
      message.put(position);
    }
    return message.put(std::uint32_t{0}).put(std::uint32_t{1}).put(7.0).bytes_so_far();
  };
  const auto bag = bag_of("sensor_msgs/msg/JointState",
                          {state({"outer", "inner"}, {1, 2}), state({"inner"}, {3}), state({"wheel"}, {})});
  ASSERT_TRUE(bag) << bag.error().message;
  ASSERT_EQ(bag->series.size(), 2U);
  EXPECT_THAT(bag->series[0].fields, ElementsAre("position.outer"));
  EXPECT_THAT(bag->series[0].values, ElementsAre(ElementsAre(1)));
  EXPECT_THAT(bag->series[1].values, ElementsAre(ElementsAre(2, 3)));
  EXPECT_THAT(fault("sensor_msgs/msg/JointState", state({"a"}, {1, 2})), HasSubstr("2 positions of 1 joints"));
  EXPECT_THAT(fault("sensor_msgs/msg/JointState", state({"a\nb"}, {1})), HasSubstr("the name of joint 1"));
}

TEST_F(Messages, EveryLengthButItsOwnIsAnError) {
  const std::string sound = imu(1, 2, 3.0);
  for (std::size_t size = 0; size < sound.size(); ++size) {
    EXPECT_THAT(fault("sensor_msgs/msg/Imu", sound.substr(0, size)),
                HasSubstr("file: /t: message 1 is no sensor_msgs/Imu"));
  }
  EXPECT_EQ(fault("sensor_msgs/msg/Imu", sound + std::string(3, '\0')), "");
  EXPECT_THAT(fault("sensor_msgs/msg/Imu", sound + std::string(4, '\0')), HasSubstr("the message ends behind"));
  std::string long_text = sound;
  long_text.replace(12, 4, "\xFF\xFF\xFF\xFF");
  EXPECT_THAT(fault("sensor_msgs/msg/Imu", long_text), HasSubstr("a length of 4294967295 stands before byte 16"));
  EXPECT_THAT(fault("sensor_msgs/msg/Imu", "\x28\xB5\x2F\xFD and so on"), HasSubstr("zstd"));
  EXPECT_THAT(fault("sensor_msgs/msg/Imu", bytes({0, 7, 0, 0}) + sound), HasSubstr("encoded as 00 07"));
}

struct Row {
  int topic;
  std::int64_t received;
  std::string data;
};

class SqliteBag : public ::testing::Test {
 protected:
  void write(const std::vector<std::array<std::string, 3>>& topics, const std::vector<Row>& rows) {
    std::filesystem::remove(file_);
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(database,
                           "PRAGMA synchronous = OFF; CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, "
                           "type TEXT NOT NULL,"
                           " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
                           "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
                           " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
                           "CREATE INDEX timestamp_idx ON messages (timestamp ASC); BEGIN",
                           nullptr, nullptr, nullptr),
              SQLITE_OK);
    for (const auto& [name, type, format] : topics) {
      const std::string sql = fmt::format(
          "INSERT INTO topics(name, type, serialization_format, offered_qos_profiles) VALUES ('{}', '{}', '{}', '')",
          name, type, format);
      ASSERT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    }
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(database, "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", -1, &insert,
                       nullptr);
    for (const Row& row : rows) {
      sqlite3_bind_int(insert, 1, row.topic);
      sqlite3_bind_int64(insert, 2, row.received);
      sqlite3_bind_blob(insert, 3, row.data.data(), static_cast<int>(row.data.size()), SQLITE_STATIC);
      sqlite3_step(insert);
      sqlite3_reset(insert);
    }
    sqlite3_finalize(insert);
    sqlite3_exec(database, "COMMIT", nullptr, nullptr, nullptr);
    sqlite3_close(database);
  }
  void execute(const char* sql) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &database), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
    sqlite3_close(database);
  }
  std::string contents() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  std::string fault(const std::optional<std::string>& topic = std::nullopt) const {
    const auto source = open_columns(file_, std::nullopt, topic);
    return source ? std::string() : source.error().message;
  }
  const test::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "bag_0.db3";
};

const std::array<std::string, 3> imu_topic{"/imu/data", "sensor_msgs/msg/Imu", "cdr"};

TEST_F(SqliteBag, ColumnsByTopicAndFieldInTheOrderOfReception) {
  write({imu_topic, {"/camera", "sensor_msgs/msg/Image", "cdr"}},
        {{1, 30, imu(10, 3, 3.0)}, {2, 15, "picture"}, {1, 10, imu(10, 1, 1.0)}, {1, 20, imu(10, 2, 2.0, false)}});
  const auto source = open_columns(file_);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->names(),
              ElementsAre("/imu/data.header.stamp", "/imu/data.angular_velocity.x", "/imu/data.angular_velocity.y",
                          "/imu/data.angular_velocity.z", "/imu/data.linear_acceleration.x",
                          "/imu/data.linear_acceleration.y", "/imu/data.linear_acceleration.z"));
  EXPECT_THAT((*source)->units(), ElementsAre("ns", "rad/s", "rad/s", "rad/s", "m/s^2", "m/s^2", "m/s^2"));
  EXPECT_EQ((*source)->form(), "ROS 2 bag (SQLite); /imu/data, 3 messages; not read: /camera (sensor_msgs/Image)");
  ColumnRequest request;
  request.columns = {5, 1};
  request.stamp = 0;
  const auto data = (*source)->read(request);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_THAT(data->values, ElementsAre(ElementsAre(11, 12, 13), ElementsAre(1, 2, 3)));
  EXPECT_THAT(data->stamps, ElementsAre(10000000001.0L, 10000000002.0L, 10000000003.0L));
  EXPECT_TRUE(std::filesystem::is_regular_file(file_));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1);  // nothing beside it
}

TEST_F(SqliteBag, SeveralImusAreAskedForAndNeverMixed) {
  write({imu_topic, {"/imu/b", "sensor_msgs/msg/Imu", "cdr"}},
        {{1, 1, imu(1, 0, 1.0)}, {1, 2, imu(2, 0, 2.0)}, {2, 3, imu(1, 500, 7.0)}});
  EXPECT_THAT(fault(""), HasSubstr("/imu/data (2 messages), /imu/b (1 messages); --topic says which is meant"));
  EXPECT_THAT(fault("/imu/c"), HasSubstr("--topic /imu/c: the topics of sensor_msgs/Imu are /imu/data"));
  EXPECT_EQ(fault("/imu/b"), "");
  const auto source = open_columns(file_);
  ASSERT_TRUE(source) << source.error().message;
  ColumnRequest request;
  request.columns = {1, 8};
  for (const bool tolerant : {false, true}) {
    request.tolerant = tolerant;
    const auto data = (*source)->read(request);
    ASSERT_FALSE(data);
    EXPECT_THAT(data.error().message, HasSubstr("columns of /imu/data and of /imu/b, whose stamps differ"));
  }
  request.columns = {8};
  EXPECT_THAT((*source)->read(request)->values, ElementsAre(ElementsAre(7)));
}

std::string temperature(std::int32_t seconds, double celsius) {
  return Cdr().header(seconds, 0, "").put(celsius).put(0.0).bytes_so_far();
}

// Stamps 0 to 12 s of the Imu; a temperature at 1, 3, 5 and 12 s: 7 s without one are more than three of its intervals.
TEST_F(SqliteBag, OtherTopicsArePutBetweenTheirStamps) {
  std::vector<Row> rows;
  for (int k = 0; k <= 12; ++k) {
    rows.push_back({1, k, imu(k, 0, k)});
  }
  for (const auto& [at, celsius] : {std::pair{1, 20.0}, {3, 24.0}, {5, 23.0}, {12, 30.0}}) {
    rows.push_back({2, at, temperature(at, celsius)});
  }
  write({imu_topic, {"/temp", "sensor_msgs/msg/Temperature", "cdr"}}, rows);
  const auto source = open_columns(file_);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->form(), HasSubstr("/temp, 4 messages, put linearly between their stamps"));
  ColumnRequest request;
  request.columns = {7};
  EXPECT_THAT((*source)->read(request).error().message,
              HasSubstr("message 1 of /imu/data: column 8 (/temp.temperature): no finite number at its time"));
  request.tolerant = true;
  const auto data = (*source)->read(request);
  const auto nan = ::testing::NanSensitiveDoubleEq(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(data->values[0], ElementsAre(nan, 20, 22, 24, 23.5, 23, nan, nan, nan, nan, nan, nan, 30));
}

// The header's stamp is the time, whatever the order of reception: as of any file, one that does not increase is told.
TEST_F(SqliteBag, StampsThatRepeatAreTold) {
  write({imu_topic}, {{1, 1, imu(1, 0, 1.0)}, {1, 2, imu(3, 0, 2.0)}, {1, 3, imu(2, 0, 3.0)}, {1, 4, imu(4, 0, 3.0)}});
  const auto map = parse_import_map(R"(map = 1
[site]
latitude_deg = 48
longitude_deg = 11
height_m = 500
[time]
column = "/imu/data.header.stamp"
unit = "ns"
[gyro]
columns = ["/imu/data.angular_velocity.x", "/imu/data.angular_velocity.y", "/imu/data.angular_velocity.z"]
kind = "rates"
unit = "rad/s"
[accelerometer]
columns = ["/imu/data.linear_acceleration.x", "/imu/data.linear_acceleration.y", "/imu/data.linear_acceleration.z"]
kind = "rates"
unit = "m/s^2"
[gimbal]
absent = true
)",
                                    "bag.toml");
  ASSERT_TRUE(map) << map.error().message;
  const auto source = open_columns(file_);
  ASSERT_TRUE(source) << source.error().message;
  const auto built = build_recording(**source, *map, "bag_0.db3");
  ASSERT_FALSE(built);
  EXPECT_THAT(built.error().message,
              HasSubstr("bag_0.db3: row 2: time 2000000000 is not after 3000000000 in the one before"));
}

TEST_F(SqliteBag, WhatIsNoBagSaysSo) {
  write({imu_topic}, {});
  EXPECT_THAT(fault(), HasSubstr("no message of type sensor_msgs/Imu"));
  write({{"/temp", "sensor_msgs/msg/Temperature", "cdr"}}, {{1, 1, temperature(1, 20.0)}});
  EXPECT_THAT(fault(), HasSubstr("no message of type sensor_msgs/Imu; topics: /temp (sensor_msgs/Temperature)"));
  write({{"/imu", "sensor_msgs/msg/Imu", "json"}}, {{1, 1, "{}"}});
  EXPECT_THAT(fault(), HasSubstr("/imu: serialised as 'json'; cdr is expected"));
  write({imu_topic}, {{1, 1, "short"}});
  EXPECT_THAT(fault(), HasSubstr("/imu/data: message 1 is no sensor_msgs/Imu: encoded as 73 68"));
  write({imu_topic}, {{1, 1, imu(1, 0, 1.0)}});
  execute("ALTER TABLE messages RENAME TO others");
  EXPECT_THAT(fault(), HasSubstr("no ROS 2 bag: tables topics and messages are expected"));
  execute(
      "CREATE VIEW messages AS WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k FROM n) "
      "SELECT 1 AS topic_id, k AS timestamp, zeroblob(300) AS data FROM n");
  EXPECT_THAT(fault(), HasSubstr("no ROS 2 bag"));
  write({imu_topic}, {{1, 1, imu(1, 0, 1.0)}});
  execute("UPDATE messages SET data = zeroblob(20000000)");
  std::filesystem::resize_file(file_, 40960);
  EXPECT_THAT(fault(), HasSubstr("SQLite cannot read it"));
  EXPECT_THAT(open_columns(folder_.path()).error().message, HasSubstr("a folder"));
}

// What a recorder that was killed left in its write-ahead log is read with the rest.
TEST_F(SqliteBag, MessagesInTheLogBesideItAreRead) {
  write({imu_topic}, {{1, 1, imu(1, 0, 1.0)}});
  sqlite3* recorder = nullptr;
  ASSERT_EQ(sqlite3_open(file_.c_str(), &recorder), SQLITE_OK);
  ASSERT_EQ(
      sqlite3_exec(
          recorder,
          "PRAGMA journal_mode = WAL; WITH RECURSIVE n(k) AS (SELECT 2 UNION ALL SELECT k + 1 FROM n WHERE k < 500) "
          "INSERT INTO messages SELECT k, 1, k, data FROM n JOIN messages WHERE id = 1",
          nullptr, nullptr, nullptr),
      SQLITE_OK);
  const std::filesystem::path killed = folder_ / "killed.db3";
  std::filesystem::copy(file_, killed);
  std::filesystem::copy(file_.string() + "-wal", killed.string() + "-wal");
  sqlite3_close(recorder);
  const auto source = open_columns(killed);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_THAT((*source)->form(), HasSubstr("/imu/data, 500 messages"));
}

TEST_F(SqliteBag, PartsAndCompressedFilesAreRefused) {
  write({imu_topic}, {{1, 1, imu(1, 0, 1.0)}});
  std::ofstream(folder_ / "metadata.yaml") << "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n"
                                              "    - bag_0.db3\n    - bag_1.db3\n  duration:\n    nanoseconds: 1\n";
  EXPECT_THAT(fault(), HasSubstr("one of 2 files of a bag that was split"));
  std::filesystem::remove(folder_ / "metadata.yaml");
  EXPECT_EQ(fault(), "");
  std::ofstream(file_, std::ios::binary) << "\x28\xB5\x2F\xFD";
  EXPECT_THAT(fault(), HasSubstr("compressed with zstd"));
}

// Bytes altered and files cut off at random: an answer or one line, never more than the file's size of messages.
TEST_F(SqliteBag, DamagedIsAnErrorAtWorst) {
  std::vector<Row> rows;
  for (int k = 0; k < 60; ++k) {
    rows.push_back({1 + k % 2, k, k % 2 == 0 ? imu(k, 0, k) : temperature(k, k)});
  }
  write({imu_topic, {"/temp", "sensor_msgs/msg/Temperature", "cdr"}}, rows);
  const std::string sound = contents();
  std::mt19937 random(5);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::string damaged = sound;
    for (int k = 0; k < 1 + trial % 8; ++k) {
      damaged[100 + random() % (sound.size() - 100)] = static_cast<char>(random());
    }
    damaged.resize(trial % 4 == 0 ? 100 + random() % (sound.size() - 100) : sound.size());
    std::ofstream(file_, std::ios::binary) << damaged;
    const std::string words = fault();
    EXPECT_EQ(words.find('\n'), std::string::npos);
    EXPECT_TRUE(words.empty() || words.find("bag_0.db3") != std::string::npos) << words;
    refused += words.empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 75);  // a quarter is cut off
}

}  // namespace
}  // namespace selfcal::import
