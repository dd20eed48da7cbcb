// As what the service is told the records of an INS.
#pragma once

#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

// No INS has it: of the schedule that the service writes where the INS takes none.
inline constexpr std::uint16_t kept_schedule_did = 0;

// The profile by which the service asks. Of an INS that is turned move by move, the schedule is kept by the service's port, and
// state, directory and result of the rotation are what the port makes of the INS's (daemon/ins/move_port): they have the
// layouts of our own INS. Any other profile is its own.
ProfilePtr told_as(const ProfilePtr& profile);

}  // namespace selfcal::profile
