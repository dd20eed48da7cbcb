// Time as the sans-IO state machines know it: given by the caller, from any clock that does not go back.
#pragma once

#include <chrono>

namespace selfcal {

using Time = std::chrono::nanoseconds;  // since an epoch of the caller's choice, or a span

}  // namespace selfcal
