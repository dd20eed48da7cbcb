// An INS that speaks no UDS: plain CAN frames whose data are signals. Commands to it, what it tells, and samples that it
// streams while it turns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/profile/roles.hpp"
#include "protocol/profile/signals.hpp"
#include "protocol/profile/turning.hpp"

namespace selfcal::profile {

struct Frame {
  std::string name;  // of the role, or of a sample's frame as the profile calls it
  std::size_t line = 0;
  std::uint32_t id = 0;
  std::size_t bytes = 8;
  std::vector<Signal> signals;

  const Signal* find(std::string_view wanted) const;
};

// The words of signal `state` are these, in this order.
enum class FrameState : std::uint8_t { starting, idle, moving, failed };

struct Frames {
  Frame identity, state, told;       // from the INS
  Frame move, read, write, reset;    // to it
  std::optional<Frame> start, stop;  // of the stream, of all motion
  std::vector<Frame> samples;        // each sample is told by one frame of each, all with its counter
  Turning turning;
};

// What an INS tells again and again beside UDS. Its identifiers are those of the bus; the ones here are not used.
struct StatusFrames {
  Frame state, gimbal;
};

// What the frames must and may tell: THE table, for the reader and for the reference.
struct FrameRole {
  std::string_view name;
  bool from_ins = false;
  bool needed = true;
  std::string_view meaning;
  std::span<const RoleField> signals;
};
std::span<const FrameRole> frame_roles();
const FrameRole& frame_role(std::string_view name);  // "sample" of every frame of a sample

// An element of a set is known by an index; inside this software by a data identifier.
inline constexpr std::uint16_t first_index_did = 0x4000;

}  // namespace selfcal::profile
