// What an INS tells in the form in which the service keeps it.
#pragma once

#include <span>

#include "daemon/ins/ins_port.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal {

// A page, of 4096 bytes. Fails (device) where its checksum is wrong, (bad_input) where its fields make no sense.
[[nodiscard]] Expected<Bytes> page_as_kept(const profile::Profile& profile, std::span<const std::uint8_t> told);
// A set of coefficients, as ins::encode has it.
Bytes set_as_kept(const ins::Coefficients& set);

}  // namespace selfcal
