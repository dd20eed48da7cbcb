// The records of our own INS, byte by byte, for the tests: a second opinion of what protocol/profile makes of
// config/profiles/selfcal.toml. Big-endian. Every decoder checks length, ranges and finiteness, and fails with kind bad_input,
// naming the field and its value.
#pragma once

#include "protocol/ins_interface/records.hpp"

namespace selfcal::ins {

Bytes encode(const StateRecord& record);
[[nodiscard]] Expected<StateRecord> decode_state(ByteView bytes);
Bytes encode(const ScheduleRecord& record);
[[nodiscard]] Expected<ScheduleRecord> decode_schedule(ByteView bytes);
Bytes encode(const DirectoryRecord& record);
[[nodiscard]] Expected<DirectoryRecord> decode_directory(ByteView bytes);
Bytes encode(const RunRecord& record);
[[nodiscard]] Expected<RunRecord> decode_run(ByteView bytes);
Bytes encode(const NavigationCheckRequest& request);
[[nodiscard]] Expected<NavigationCheckRequest> decode_navigation_request(ByteView bytes);
Bytes encode(const NavigationCheckRecord& record);
[[nodiscard]] Expected<NavigationCheckRecord> decode_navigation_result(ByteView bytes);

}  // namespace selfcal::ins
