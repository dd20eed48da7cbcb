// The key to a seed, as the profile says: AES-CMAC, or by a program of the user's own while the loop goes on.
#pragma once

#include "daemon/host/task.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal {

// Breaking off the task kills the program.
Task<Expected<std::vector<std::uint8_t>>> answer_seed(Timers& timers, const profile::Security& security, UnlockKey key,
                                                      std::vector<std::uint8_t> seed);

}  // namespace selfcal
