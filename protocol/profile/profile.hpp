// What an INS speaks: its addresses, identifiers, records, routines, raw data and axes, as a value. It is read from a file
// (read_profile.hpp); our own INS's stands in config/profiles/selfcal.toml and is compiled in.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "protocol/key_program/key_program.hpp"
#include "protocol/profile/frames.hpp"
#include "protocol/profile/layout.hpp"
#include "protocol/profile/record_memory.hpp"
#include "protocol/profile/set_form.hpp"
#include "protocol/profile/turning.hpp"

namespace selfcal::profile {

struct Bus {
  bool extended_ids = false;  // 29-bit identifiers
  bool fd = false;
  std::uint32_t request = 0, response = 0, functional = 0;
  // Extended and mixed addressing: the first byte of each frame. All three or none.
  std::optional<std::uint8_t> request_byte, response_byte, functional_byte;
  std::optional<std::uint32_t> status;  // of the state frame; the gimbal frame has the next one
  std::uint8_t padding = 0xCC;
  std::uint8_t block_size = 0, st_min = 0;  // told to the INS when it sends
};

struct Timing {
  double request_timeout_s = 1.0;  // P2 of the client; the INS's own statement lengthens it
  double p2_star_s = 5.0;
  double tester_present_s = 2.0;
  // How long the INS may take: to erase a slot, to write a set, to put it in force; on its own clock, to restart and to stop its
  // gimbal. Behind them the service gives up. A sector of serial NOR FLASH is erased in 0.4 s at the most and a page of it programmed
  // in 3 ms: ten times that, and twice for an erased slot that is tidied up. A gimbal of 90 deg/s stops in a second or two.
  double erase_s = 8.0, write_s = 4.0, commit_s = 4.0, restart_s = 60.0, stop_s = 30.0;
};

struct Security {
  bool needed = true;                 // the lock is opened by the key to a seed
  std::uint8_t level = 1;             // of requestSeed; sendKey has the next
  std::optional<KeyProgram> program;  // that says the key; without one it is AES-CMAC of the seed
  std::size_t seed_bytes = 16, key_bytes = 16;
};

// A record of a role: which identifier has it, or by which number it stands in Profile::memory; where its fields stand; and which
// values the INS does not tell because they are always the same.
struct Record {
  std::optional<std::uint16_t> did;
  Layout layout;
  std::map<std::string, double, std::less<>> given;
};

struct Routine {
  std::optional<std::uint16_t> id;
  Layout start;   // option of the start; without fields: none
  Layout result;  // of requestRoutineResults
};

// An INS that streams its samples keeps none. The service then keeps them as pages, and their directory, which it asks for by an
// identifier that ISO 14229-1 (table C.1) reserves, so that no INS has it.
inline constexpr std::uint16_t kept_directory = 0xFFFF;

// An INS that takes no schedule: each position is commanded by itself, by a write or by the start of a routine. The service is
// answered in its own INS's records all the same (told_as.hpp, daemon/ins/move_port).
struct Move {
  std::optional<std::uint16_t> did, routine;  // one of both
  Layout layout;
  Turning turning;  // by angle, or by `gimbal_moving` of the state
};

// The raw data: how their pages are asked for, and what they hold.
struct Raw {
  Layout page;
  enum class Way : std::uint8_t { upload, memory, file, stream };
  Way way = Way::upload;            // RequestUpload, ReadMemoryByAddress, RequestFileTransfer, or frames while it turns
  bool by_page = true;              // RequestUpload's address counts pages; else bytes
  std::uint32_t first_address = 0;  // of ReadMemoryByAddress: where page 0 of the run begins
  std::uint64_t end_address = std::uint64_t{1} << 32U;  // the first one behind the raw data
  std::uint32_t longest_read = 0;                       // bytes that it tells at once
  std::size_t address_bytes = 4, size_bytes = 4;
  std::string file;  // of RequestFileTransfer: the name of a page's file (raw_file.hpp)
  // Our axis k is the INS's axis index[k], times sign[k].
  std::array<std::size_t, 3> axis{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};
  std::array<std::size_t, 2> gimbal{0, 1};  // our outer and inner: which of the INS's
  std::array<int, 2> gimbal_sign{1, 1};
};

struct Profile {
  std::string name;  // "selfcal"
  std::string file;
  Bus bus;
  Timing timing;
  std::uint8_t session = 3;  // for everything but reading
  Security security;
  RecordMemory memory;  // which of the identifiers here are none, but stand for a place in the INS's memory
  std::uint16_t serial = 0, software = 0;
  Record state, schedule, site, directory, sample_format;
  std::optional<Move> move;  // in place of `schedule`
  // Without slots a set is written over the one in force, and used from the next power-on on.
  bool slots = true;
  bool field_by_field = false;  // each field of a set has an identifier of its own (Field::did), in the order of `set`
  std::optional<std::uint16_t> set_in_force, set_inactive, set_factory;
  Layout set;
  SetForm set_form = SetForm::errors;
  Routine rotate, erase, commit, navigation_check;
  Raw raw;
  StatusFrames status;  // where `bus` has their identifier
  // An INS that speaks no UDS. All the rest is then what the service asks itself in its place (daemon/ins/frame_port).
  std::optional<Frames> frames;
  std::vector<Frame> stream;  // Raw::Way::stream: the frames of a sample, beside UDS
};
using ProfilePtr = std::shared_ptr<const Profile>;

// The frames of a sample, where samples are streamed.
inline const std::vector<Frame>& sample_frames(const Profile& profile) {
  return profile.frames ? profile.frames->samples : profile.stream;
}

// The directory's identifier, where the INS tells one.
inline std::optional<std::uint16_t> told_directory(const Profile& profile) {
  return profile.directory.did == kept_directory ? std::nullopt : profile.directory.did;
}

// What the service writes: the others are only read.
bool is_written(const Profile& profile, std::uint16_t did);

// Our own INS: config/profiles/selfcal.toml, as compiled in.
const ProfilePtr& built_in();

}  // namespace selfcal::profile
