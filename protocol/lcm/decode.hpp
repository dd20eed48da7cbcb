// LCM messages as they come from the network: anybody who reaches the multicast group can send one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <selfcal_lcm/alarm.hpp>
#include <selfcal_lcm/estimate.hpp>
#include <selfcal_lcm/ins_status.hpp>
#include <selfcal_lcm/service_status.hpp>
#include <span>
#include <string_view>

namespace selfcal::lcm_messages {

// No message of ours is longer: what lcm-gen's code allocates for a count that it has not checked stays small.
inline constexpr std::size_t longest = 65536;
inline constexpr std::int32_t most_parameters = 1024;

namespace detail {

// The fields of a message behind its hash, in the order of the .lcm file: i int32_t, l int64_t, d double, b boolean,
// s text; n an int32_t that counts the elements of the arrays S (texts) and D (doubles).
template <typename Message>
inline constexpr std::string_view fields = {};
template <>
inline constexpr std::string_view fields<selfcal_lcm::service_status> = "ilsiid";
template <>
inline constexpr std::string_view fields<selfcal_lcm::ins_status> = "ilssslbddiidiiils";
template <>
inline constexpr std::string_view fields<selfcal_lcm::estimate> = "ilslidnSSDDDibddd";
template <>
inline constexpr std::string_view fields<selfcal_lcm::alarm> = "ilslbs";

// Walks over the fields; what it does not find within the bytes is what `sound` then says.
class Walk {
 public:
  explicit Walk(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool sound() const { return sound_; }

  void skip(std::size_t count) {
    sound_ = sound_ && count <= bytes_.size();
    bytes_ = sound_ ? bytes_.subspan(count) : std::span<const std::uint8_t>{};
  }
  std::int32_t integer() {
    std::uint32_t value = 0;
    for (const std::uint8_t byte : bytes_.first(std::min<std::size_t>(4, bytes_.size()))) {
      value = value << 8U | byte;
    }
    skip(4);
    return static_cast<std::int32_t>(value);
  }
  void text() {  // its length counts the NUL behind it
    const std::int32_t length = integer();
    sound_ = sound_ && length >= 1;
    skip(sound_ ? static_cast<std::size_t>(length) : 0);
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool sound_ = true;
};

inline bool lengths_are_sound(std::string_view fields, std::span<const std::uint8_t> bytes) {
  Walk walk(bytes);
  walk.skip(8);  // the hash
  std::int32_t count = 0;
  for (const char field : fields) {
    if (field == 'n') {
      count = walk.integer();
      if (count < 0 || count > most_parameters) {
        return false;
      }
    } else if (field == 's') {
      walk.text();
    } else if (field == 'S') {
      for (std::int32_t k = 0; k < count; ++k) {
        walk.text();
      }
    } else {
      const std::size_t elements = field == 'D' ? static_cast<std::size_t>(count) : 1;
      walk.skip(elements * (field == 'b' ? 1 : field == 'i' ? 4 : 8));
    }
  }
  return walk.sound();
}

}  // namespace detail

// nullopt: not a whole message of this type. lcm-gen's decoder alone reads gigabytes beyond the message on a text of the
// most negative length, throws on other lengths and on negative counts, through the C library that called it, and
// allocates what a count says before it looks for the values.
template <typename Message>
std::optional<Message> decode(std::span<const std::uint8_t> bytes) {
  static_assert(!detail::fields<Message>.empty());
  if (bytes.size() > longest || !detail::lengths_are_sound(detail::fields<Message>, bytes)) {
    return std::nullopt;
  }
  Message message;
  return message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0 ? std::nullopt : std::optional(message);
}

}  // namespace selfcal::lcm_messages
