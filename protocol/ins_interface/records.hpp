// What an INS is told and tells, as this software knows it. The bytes are its profile's matter (profile/records); site and sample
// format have bytes here too, big-endian, in which the service keeps them beside the pages of a run.
//
// check(): the ranges of its values, whatever bytes they came from; bad_input, naming the field and its value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/ins_interface/status.hpp"

namespace selfcal::ins {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

enum class Slot : std::uint8_t { factory = 0, a = 1, b = 2 };

struct StateRecord {
  State state = State::starting;
  std::uint8_t faults = 0;  // of fault::
  Slot in_force = Slot::factory;
  std::uint32_t coefficients_version = 0;  // in force
  std::uint32_t coefficients_crc = 0;      // of the record in force
  std::uint32_t run_id = 0;                // latest self-calibration, 0: none
  std::uint32_t power_cycles = 0;
  // Of an INS whose gimbal is told each move by itself, as far as its profile has them.
  bool moving = false;
  double outer_deg = 0.0, inner_deg = 0.0;
};
[[nodiscard]] Expected<void> check(const StateRecord& record);

inline constexpr std::size_t max_positions = 255;
struct ScheduleRecord {
  struct Position {
    std::int32_t outer_mdeg = 0;  // |angle| <= 360000
    std::int32_t inner_mdeg = 0;
    std::uint32_t dwell_ms = 0;
    bool operator==(const Position&) const = default;
  };
  std::vector<Position> positions;  // 1..255
  std::uint32_t rotation_ms = 0;    // from one position to the next
  bool operator==(const ScheduleRecord&) const = default;
};
[[nodiscard]] Expected<void> check(const ScheduleRecord& record);

// A position that the gimbal is told by itself.
struct MoveRecord {
  std::int32_t outer_mdeg = 0;  // |angle| <= 360000
  std::int32_t inner_mdeg = 0;
  bool operator==(const MoveRecord&) const = default;
};
[[nodiscard]] Expected<void> check(const MoveRecord& record);

struct SiteRecord {
  double latitude_deg = 0.0;  // WGS-84
  double longitude_deg = 0.0;
  double height_m = 0.0;  // ellipsoidal
};
Bytes encode(const SiteRecord& record);
[[nodiscard]] Expected<SiteRecord> decode_site(ByteView bytes);
[[nodiscard]] Expected<void> check(const SiteRecord& record);

// The pages of the latest run. Page p of RequestUpload is page p of the run, from 0.
struct DirectoryRecord {
  std::uint32_t run_id = 0;
  std::uint32_t first_page = 0;      // older ones were overwritten by the ring
  std::uint32_t pages_written = 0;   // pages first_page .. pages_written-1 can be uploaded
  std::uint32_t pages_expected = 0;  // of the whole schedule; of an INS that knows none, 0
  std::uint64_t samples = 0;         // written so far
  bool complete = false;             // no more will come

  bool operator==(const DirectoryRecord&) const = default;
};
[[nodiscard]] Expected<void> check(const DirectoryRecord& record);

struct SampleFormatRecord {
  double sample_rate_hz = 0.0;
  double delta_theta_lsb_rad = 0.0;  // rad per count
  double delta_v_lsb_mps = 0.0;      // m/s per count
  double gimbal_lsb_rad = 0.0;       // rad per count
  std::uint32_t page_bytes = 0;
  std::uint16_t samples_per_page = 0;
};
Bytes encode(const SampleFormatRecord& record);
[[nodiscard]] Expected<SampleFormatRecord> decode_sample_format(ByteView bytes);
[[nodiscard]] Expected<void> check(const SampleFormatRecord& record);

// Result of routine self_calibration.
struct RunRecord {
  State state = State::idle;
  std::uint8_t faults = 0;
  std::uint8_t position = 0;
  std::uint32_t run_id = 0;
  std::uint32_t pages_written = 0;
};

// Free-inertial navigation at rest from a known start: how far it drifts.
struct NavigationCheckRequest {
  std::uint32_t duration_s = 3600;    // of the INS's own time
  Slot compensation = Slot::factory;  // factory, or any other: what is in force
};

struct NavigationCheckRecord {
  bool done = false;
  double elapsed_s = 0.0;
  double north_m = 0.0;  // computed minus known position
  double east_m = 0.0;
  double max_horizontal_m = 0.0;
};
[[nodiscard]] Expected<void> check(const NavigationCheckRecord& record);

}  // namespace selfcal::ins
