#include "protocol/can/frame.hpp"

#include <algorithm>
#include <cassert>

namespace selfcal::can {
namespace {

constexpr std::array<std::uint8_t, 16> size_table = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

}  // namespace

bool CanFrame::operator==(const CanFrame& other) const {
  return id == other.id && extended == other.extended && remote == other.remote && fd == other.fd &&
         bit_rate_switch == other.bit_rate_switch && error_state == other.error_state && size == other.size &&
         (remote || std::ranges::equal(payload(), other.payload()));
}

std::uint8_t dlc_of_size(std::size_t size) {
  assert(size <= max_fd_bytes);
  return static_cast<std::uint8_t>(std::ranges::lower_bound(size_table, size) - size_table.begin());
}

std::size_t size_of_dlc(std::uint8_t dlc) {
  assert(dlc < size_table.size());
  return size_table[dlc];
}

std::size_t frame_size_for(std::size_t bytes) { return size_of_dlc(dlc_of_size(bytes)); }

}  // namespace selfcal::can
