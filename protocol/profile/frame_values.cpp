#include "protocol/profile/frame_values.hpp"

#include <algorithm>

namespace selfcal::profile {

std::optional<double> value(const Frame& kind, std::string_view name, const can::CanFrame& frame) {
  const Signal* signal = kind.find(name);
  return signal == nullptr ? std::nullopt : std::optional(value_of(*signal, raw_of(*signal, frame.payload())));
}

std::uint64_t raw(const Frame& kind, std::string_view name, const can::CanFrame& frame) {
  return raw_of(*kind.find(name), frame.payload());
}

std::uint64_t bits_of(const Field& field, std::span<const std::uint8_t> bytes) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    bits = bits << 8U | bytes[field.order == profile::ByteOrder::big ? k : bytes.size() - 1 - k];
  }
  return bits;
}

std::vector<std::uint8_t> bytes_of(const Field& field, std::uint64_t bits) {
  std::vector<std::uint8_t> bytes(field.type.bytes);
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    const std::size_t shift = field.order == profile::ByteOrder::big ? bytes.size() - 1 - k : k;
    bytes[k] = static_cast<std::uint8_t>(bits >> (8 * shift));
  }
  return bytes;
}

const Field* field_of(const Profile& profile, std::uint16_t did) {
  const auto found = std::ranges::find(profile.set.fields, std::optional(did), &Field::did);
  return found == profile.set.fields.end() ? nullptr : &*found;
}

}  // namespace selfcal::profile
