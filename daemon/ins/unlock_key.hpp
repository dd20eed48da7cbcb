// The SecurityAccess key: 16 bytes, as 32 hexadecimal digits in a file that others cannot read. Never logged.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "daemon/host/config.hpp"
#include "protocol/error.hpp"

namespace selfcal {

using UnlockKey = std::array<std::uint8_t, 16>;

// Of an INS without a lock, or whose key a program says: none, all zeros. Else from key_file, else from the systemd credential NAME.key, else from the credential ins.key.
Expected<UnlockKey> load_unlock_key(const InsConfig& config);

}  // namespace selfcal
