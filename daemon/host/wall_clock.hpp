// UTC for records and messages. Nothing is decided by it: the wall clock may be set back at any time.
#pragma once

#include <cstdint>
#include <string>

namespace selfcal {

std::string utc_now();                       // 2026-11-21T07:10:00Z
std::string utc_text(std::int64_t seconds);  // the same, of seconds since 1970
std::int64_t utc_now_us();                   // microseconds since 1970

}  // namespace selfcal
