// ROS 1's bags, read with librosbag_storage in a child process: it does not survive every damaged file.
#include <fmt/format.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>

#include "protocol/import/bag.hpp"
#include "protocol/recording/isolated_parse.hpp"

namespace selfcal::import {
namespace {

void put(std::string& out, std::uint64_t number) { out.append(reinterpret_cast<const char*>(&number), sizeof number); }
void put(std::string& out, const std::string& text) {
  put(out, text.size());
  out += text;
}
template <typename Element>
void put(std::string& out, const std::vector<Element>& all) {
  put(out, all.size());
  if constexpr (std::is_arithmetic_v<Element>) {
    out.append(reinterpret_cast<const char*>(all.data()), all.size() * sizeof(Element));
  } else {
    for (const Element& one : all) {
      put(out, one);
    }
  }
}

// Our own child wrote it: no checks.
class Taker {
 public:
  explicit Taker(const std::string& bytes) : bytes_(bytes) {}

  void take(std::uint64_t& number) { copy(&number, sizeof number); }
  void take(std::string& text) {
    text.resize(size());
    copy(text.data(), text.size());
  }
  template <typename Element>
  void take(std::vector<Element>& all) {
    all.resize(size());
    if constexpr (std::is_arithmetic_v<Element>) {
      copy(all.data(), all.size() * sizeof(Element));
    } else {
      for (Element& one : all) {
        take(one);
      }
    }
  }
  std::uint64_t size() {
    std::uint64_t number = 0;
    take(number);
    return number;
  }

 private:
  void copy(void* to, std::size_t size) {
    if (size > 0) {
      std::memcpy(to, bytes_.data() + at_, size);
      at_ += size;
    }
  }
  const std::string& bytes_;
  std::size_t at_ = 0;
};

std::string bytes_of(const Bag& bag) {
  std::string out;
  put(out, bag.form);
  put(out, bag.not_read);
  put(out, bag.series.size());
  for (const Series& series : bag.series) {
    put(out, series.topic);
    put(out, series.type);
    put(out, series.fields);
    put(out, series.units);
    put(out, series.received_ns);
    put(out, series.stamp_ns);
    put(out, series.values);
  }
  return out;
}

Bag bag_of(const std::string& bytes) {
  Taker taker(bytes);
  Bag bag;
  taker.take(bag.form);
  taker.take(bag.not_read);
  bag.series.resize(taker.size());
  for (Series& series : bag.series) {
    taker.take(series.topic);
    taker.take(series.type);
    taker.take(series.fields);
    taker.take(series.units);
    taker.take(series.received_ns);
    taker.take(series.stamp_ns);
    taker.take(series.values);
  }
  return bag;
}

// Where the library puts the bytes of a message.
class Message {
 public:
  explicit Message(std::size_t size) : bytes_(size, '\0') {}
  std::uint8_t* getData() { return reinterpret_cast<std::uint8_t*>(bytes_.data()); }
  std::uint8_t* advance(std::uint32_t count) {
    if (count > bytes_.size() - at_) {
      throw rosbag::BagFormatException("a message is longer than it says");
    }
    std::uint8_t* here = getData() + at_;
    at_ += count;
    return here;
  }
  std::uint32_t getLength() const { return static_cast<std::uint32_t>(bytes_.size() - at_); }
  std::string_view bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

// Of this process, the child: chunks announce sizes up to 4 GiB, and bz2 may keep such a promise with few bytes.
void bound_memory(const std::string& file) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  (void)file;  // their shadows are larger than any bound
#else
  constexpr rlim_t own = rlim_t{2} << 30;
  constexpr rlim_t a_byte = 8;
  std::error_code none;
  const rlim_t most = own + a_byte * std::filesystem::file_size(file, none);
  const rlimit bound{most, most};
  ::setrlimit(RLIMIT_AS, &bound);
#endif
}

// The library would look for the plugin that the header names, and for keys.
bool encrypted(const std::string& file) {
  constexpr std::size_t longest_header = 4096;
  std::string head(longest_header, ' ');
  std::ifstream(file, std::ios::binary).read(head.data(), longest_header);
  return head.find("encryptor=") != std::string::npos;
}

Expected<Bag> messages_of(const std::string& file) {
  if (encrypted(file)) {
    return fail(ErrorKind::bad_input, fmt::format("{}: an encrypted ROS 1 bag; `rosbag decrypt` opens it", file));
  }
  bound_memory(file);
  rosbag::Bag bag(file, rosbag::bagmode::Read);
  rosbag::View view(bag);
  BagBuilder builder(file, "ROS 1 bag", Encoding::ros1);
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    if (const auto topic = builder.topic(connection->topic, connection->datatype); !topic) {
      return tl::unexpected(topic.error());
    }
  }
  for (const rosbag::MessageInstance& instance : view) {
    const auto topic = builder.topic(instance.getTopic(), instance.getDataType());
    if (!topic) {
      return tl::unexpected(topic.error());
    }
    if (!builder.wanted(*topic)) {
      continue;
    }
    Message message(instance.size());
    instance.write(message);
    if (const auto taken =
            builder.message(*topic, static_cast<std::int64_t>(instance.getTime().toNSec()), message.bytes());
        !taken) {
      return tl::unexpected(taken.error());
    }
  }
  return builder.finish();
}

// One line of what the library says.
Expected<std::string> read_here(const std::string& file) {
  try {
    return messages_of(file).map(bytes_of);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    std::string words = error.what();
    std::replace_if(
        words.begin(), words.end(), [](char c) { return c < ' ' || c > '~'; }, ' ');
    return fail(ErrorKind::bad_input, fmt::format("{}: cannot read as ROS 1 bag: {}", file, words));
  }
}

}  // namespace

Expected<Bag> read_ros1_bag(const std::filesystem::path& file) {
  const std::string name = file.string();
  return bytes_isolated(name, [&name] { return read_here(name); }).map(bag_of);
}

}  // namespace selfcal::import
