// The service's records in the bytes of an INS, and back. Readers check what ins::check checks besides; all fail with kind
// bad_input, naming record, field and value.
#pragma once

#include "protocol/flash/page.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "protocol/ins_interface/records.hpp"
#include "protocol/profile/profile.hpp"

namespace selfcal::profile {

[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::StateRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::ScheduleRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::MoveRecord& record);  // where it has moves
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::SiteRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::DirectoryRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::SampleFormatRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::RunRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::NavigationCheckRequest& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::NavigationCheckRecord& record);
[[nodiscard]] Expected<Bytes> encode(const Profile& profile, const ins::Coefficients& set);

[[nodiscard]] Expected<ins::StateRecord> decode_state(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::ScheduleRecord> decode_schedule(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::MoveRecord> decode_move(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::SiteRecord> decode_site(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::DirectoryRecord> decode_directory(const Profile& profile, ByteView bytes);
// Of what the profile gives where the INS tells nothing: `bytes` may then be empty.
[[nodiscard]] Expected<ins::SampleFormatRecord> decode_sample_format(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::RunRecord> decode_run(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::NavigationCheckRequest> decode_navigation_request(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::NavigationCheckRecord> decode_navigation_result(const Profile& profile, ByteView bytes);
[[nodiscard]] Expected<ins::Coefficients> decode_coefficients(const Profile& profile, ByteView bytes);

// Option of the routine that rotates, and of the one that puts a set in force; the latter is told the checksum that the set's
// record holds, where the profile says so.
[[nodiscard]] Expected<Bytes> rotation_start(const Profile& profile, std::uint32_t run_id);
[[nodiscard]] Expected<std::uint32_t> read_rotation_start(const Profile& profile, ByteView option);
[[nodiscard]] Expected<Bytes> commit_start(const Profile& profile, ByteView set);

// A page of the INS and as the service keeps it: counts, in our axes.
[[nodiscard]] Expected<Bytes> encode_page(const Profile& profile, const flash::Page& page);
[[nodiscard]] Expected<flash::Page> decode_page(const Profile& profile, ByteView bytes);

}  // namespace selfcal::profile
