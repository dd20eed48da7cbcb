// LCM messages as they come from the network: anybody who reaches the multicast group can send one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <selfcal_lcm/alarm.hpp>
#include <selfcal_lcm/estimate.hpp>
#include <selfcal_lcm/ins_status.hpp>
#include <selfcal_lcm/service_status.hpp>
#include <span>
#include <stdexcept>

namespace selfcal::lcm_messages {

// No message of ours is longer: what lcm-gen's code allocates for a count that it has not checked stays small.
inline constexpr std::size_t longest = 65536;
inline constexpr std::int32_t most_parameters = 1024;

namespace detail {

inline std::optional<std::int32_t> int_at(std::span<const std::uint8_t> bytes, std::size_t place) {
  if (bytes.size() < 4 || place > bytes.size() - 4) {
    return std::nullopt;
  }
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(place, 4)) {
    value = value << 8U | byte;
  }
  return static_cast<std::int32_t>(value);
}

// The count of parameters, whose place in the message depends on the length of the text before it.
inline bool count_is_sound(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t before_text = 8 + 4 + 8;       // hash, schema, utime_us
  constexpr std::size_t behind_text = 8 + 4 + 8;       // run, pass_number, pass_fraction
  const auto text = int_at(bytes, before_text);
  if (!text || *text < 1) {
    return false;
  }
  const auto count = int_at(bytes, before_text + 4 + static_cast<std::size_t>(*text) + behind_text);
  return count && *count >= 0 && *count <= most_parameters;
}

}  // namespace detail

// nullopt: not a whole message of this type. lcm-gen's decoder alone throws on texts of length 0 and on negative counts,
// through the C library that called it, and allocates what a count says before it looks for the values.
template <typename Message>
std::optional<Message> decode(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > longest) {
    return std::nullopt;
  }
  if constexpr (std::is_same_v<Message, selfcal_lcm::estimate>) {
    if (!detail::count_is_sound(bytes)) {
      return std::nullopt;
    }
  }
  try {
    Message message;
    return message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) < 0 ? std::nullopt : std::optional(message);
  } catch (const std::length_error&) {
    return std::nullopt;
  }
}

}  // namespace selfcal::lcm_messages
