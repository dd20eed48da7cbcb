// Signals of a frame by name, and the fields of a set as the bits of one.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/can/frame.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

// None where the frame has no such signal.
std::optional<double> value(const Frame& kind, std::string_view name, const can::CanFrame& frame);
// Of a signal that is there.
std::uint64_t raw(const Frame& kind, std::string_view name, const can::CanFrame& frame);

// The field of the set that this software knows by that identifier.
const Field* field_of(const Profile& profile, std::uint16_t did);
std::uint64_t bits_of(const Field& field, std::span<const std::uint8_t> bytes);
std::vector<std::uint8_t> bytes_of(const Field& field, std::uint64_t bits);

}  // namespace selfcal::profile
