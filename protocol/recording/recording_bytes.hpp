// A recording as bytes in a file descriptor, between two processes of this very program: native layout, no versions.
#pragma once

#include "protocol/error.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

bool write_bytes(int descriptor, const Expected<Recording>& recording);
// An error (internal) where the bytes do not make sense: the child that wrote them was not sound.
Expected<Recording> read_bytes(int descriptor);

}  // namespace selfcal
