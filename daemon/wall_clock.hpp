// UTC for records and messages. Nothing is decided by it: the wall clock may be set back at any time.
#pragma once

#include <cstdint>
#include <string>

namespace selfcal {

std::string utc_now();              // 2026-11-21T07:10:00Z
std::int64_t utc_now_us();          // microseconds since 1970

}  // namespace selfcal
