// Requests and responses as bytes: the client writes requests and reads responses, the server the other way.
// Readers take a positive response (service + 0x40 first) and fail with kind device, naming what is wrong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/error.hpp"
#include "protocol/time.hpp"
#include "protocol/uds/services.hpp"

namespace selfcal::uds {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;
using Reply = tl::expected<Bytes, Nrc>;  // of a server: a positive response, or the code of the negative one

inline constexpr std::size_t seed_bytes = 16;

// Requests
Bytes session_request(Session session);
Bytes reset_request(ResetType type);
Bytes tester_present_request(bool suppress_response);
Bytes seed_request(std::uint8_t level = security_seed_level);  // sendKey has the next one
Bytes key_request(ByteView key, std::uint8_t seed_level = security_seed_level);
Bytes read_request(std::uint16_t did);
Bytes write_request(std::uint16_t did, ByteView record);
Bytes routine_request(RoutineAction action, std::uint16_t routine, ByteView option = {});
// Bytes that address and size of RequestUpload have (addressAndLengthFormatIdentifier), 1 to 4 each.
struct UploadFormat {
  std::size_t address_bytes = 4, size_bytes = 4;
};
Bytes upload_request(std::uint32_t address, std::uint32_t bytes, UploadFormat format = {});
Bytes memory_request(std::uint32_t address, std::uint32_t bytes, UploadFormat format = {});
Bytes write_memory_request(std::uint32_t address, ByteView data, UploadFormat format = {});
// ReadFile, uncompressed.
Bytes file_request(std::string_view name);
Bytes transfer_request(std::uint8_t block);  // 1 first; after 0xFF comes 0x00
Bytes transfer_exit_request();

// Responses, as the client reads them
struct SessionTimings {
  Time p2{0};
  Time p2_star{0};
};
[[nodiscard]] Expected<SessionTimings> read_session_response(ByteView response, Session session);
[[nodiscard]] Expected<void> read_reset_response(ByteView response, ResetType type);
// All zeros: already unlocked.
[[nodiscard]] Expected<Bytes> read_seed_response(ByteView response, std::uint8_t level = security_seed_level,
                                                 std::size_t length = seed_bytes);
[[nodiscard]] Expected<void> read_key_response(ByteView response, std::uint8_t seed_level = security_seed_level);
[[nodiscard]] Expected<ByteView> read_read_response(ByteView response, std::uint16_t did);  // the record
[[nodiscard]] Expected<void> read_write_response(ByteView response, std::uint16_t did);
[[nodiscard]] Expected<ByteView> read_routine_response(ByteView response, RoutineAction action,
                                                       std::uint16_t routine);  // the status record
[[nodiscard]] Expected<std::uint32_t> read_upload_response(ByteView response);  // longest TransferData response, bytes
struct FileAnswer {
  std::uint32_t longest = 0;  // TransferData response, bytes
  std::uint64_t bytes = 0;    // of the file
};
[[nodiscard]] Expected<FileAnswer> read_file_response(ByteView response);
[[nodiscard]] Expected<ByteView> read_memory_response(ByteView response, std::uint32_t bytes);  // the data, so many
// It repeats format, address and size of the request.
[[nodiscard]] Expected<void> read_write_memory_response(ByteView response, std::uint32_t address, std::uint32_t bytes,
                                                        UploadFormat format = {});
[[nodiscard]] Expected<ByteView> read_transfer_response(ByteView response, std::uint8_t block);  // the data
[[nodiscard]] Expected<ByteView> read_transfer_exit_response(ByteView response);                 // the parameter record

// What a TransferData response of `max_block` bytes carries: two of them are service and block counter.
inline constexpr std::size_t transfer_overhead = 2;

// Requests, as the server reads them; the error is the NRC to answer with.
struct UploadRange {
  std::uint32_t address = 0;  // of our own INS a page of the run
  std::uint32_t bytes = 0;
};
struct RoutineCall {
  RoutineAction action = RoutineAction::start;
  std::uint16_t routine = 0;
  ByteView option;
};
[[nodiscard]] tl::expected<UploadRange, Nrc> parse_upload_request(ByteView request, UploadFormat format = {});
[[nodiscard]] tl::expected<UploadRange, Nrc> parse_memory_request(ByteView request, UploadFormat format = {});
struct MemoryWrite {
  UploadRange range;
  ByteView data;  // as many bytes as the range has
};
[[nodiscard]] tl::expected<MemoryWrite, Nrc> parse_write_memory_request(ByteView request, UploadFormat format = {});
[[nodiscard]] tl::expected<std::string, Nrc> parse_file_request(ByteView request);  // the file's name
[[nodiscard]] tl::expected<RoutineCall, Nrc> parse_routine_request(ByteView request);

// Responses, as the server writes them
std::array<std::uint8_t, 3> negative_response(std::uint8_t service, Nrc nrc);
Bytes session_response(Session session, const SessionTimings& timings);
Bytes seed_response(ByteView seed, std::uint8_t level = security_seed_level);
Bytes read_response(std::uint16_t did, ByteView record);
Bytes write_response(std::uint16_t did);
Bytes routine_response(const RoutineCall& call, ByteView status = {});
Bytes upload_response(std::uint32_t max_block);
Bytes file_response(std::uint32_t max_block, std::uint32_t file_bytes);
Bytes memory_response(ByteView data);
Bytes write_memory_response(const UploadRange& range, UploadFormat format = {});
// Service, counter, data, into a buffer that is kept: 16 MB go this way.
void transfer_response(std::uint8_t block, ByteView data, Bytes& out);
Bytes transfer_exit_response(ByteView parameters = {});

}  // namespace selfcal::uds
