#include "daemon/ins/frame_values.hpp"

#include <algorithm>

namespace selfcal {

std::optional<double> value(const profile::Frame& kind, std::string_view name, const can::CanFrame& frame) {
  const profile::Signal* signal = kind.find(name);
  return signal == nullptr ? std::nullopt
                           : std::optional(profile::value_of(*signal, profile::raw_of(*signal, frame.payload())));
}

std::uint64_t raw(const profile::Frame& kind, std::string_view name, const can::CanFrame& frame) {
  return profile::raw_of(*kind.find(name), frame.payload());
}

std::uint64_t bits_of(const profile::Field& field, std::span<const std::uint8_t> bytes) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    bits = bits << 8U | bytes[field.order == profile::ByteOrder::big ? k : bytes.size() - 1 - k];
  }
  return bits;
}

std::vector<std::uint8_t> bytes_of(const profile::Field& field, std::uint64_t bits) {
  std::vector<std::uint8_t> bytes(field.type.bytes);
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    const std::size_t shift = field.order == profile::ByteOrder::big ? bytes.size() - 1 - k : k;
    bytes[k] = static_cast<std::uint8_t>(bits >> (8 * shift));
  }
  return bytes;
}

const profile::Field* field_of(const profile::Profile& profile, std::uint16_t did) {
  const auto found = std::ranges::find(profile.set.fields, std::optional(did), &profile::Field::did);
  return found == profile.set.fields.end() ? nullptr : &*found;
}

}  // namespace selfcal
