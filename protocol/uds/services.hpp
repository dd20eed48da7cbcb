// Names and numbers of ISO 14229-1 that are in use here.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace selfcal::uds {

namespace service {
inline constexpr std::uint8_t session_control = 0x10;
inline constexpr std::uint8_t ecu_reset = 0x11;
inline constexpr std::uint8_t read_data = 0x22;
inline constexpr std::uint8_t read_memory = 0x23;
inline constexpr std::uint8_t security_access = 0x27;
inline constexpr std::uint8_t write_data = 0x2E;
inline constexpr std::uint8_t routine_control = 0x31;
inline constexpr std::uint8_t request_upload = 0x35;
inline constexpr std::uint8_t transfer_data = 0x36;
inline constexpr std::uint8_t transfer_exit = 0x37;
inline constexpr std::uint8_t file_transfer = 0x38;
inline constexpr std::uint8_t write_memory = 0x3D;
inline constexpr std::uint8_t tester_present = 0x3E;
inline constexpr std::uint8_t negative_response = 0x7F;
}  // namespace service

inline constexpr std::uint8_t positive_offset = 0x40;        // response service = request service + this
inline constexpr std::uint8_t suppress_response_bit = 0x80;  // in the sub-function

enum class Session : std::uint8_t { standard = 1, programming = 2, extended = 3 };  // "default" is a keyword
enum class ResetType : std::uint8_t { hard = 1, key_off_on = 2, soft = 3 };
enum class RoutineAction : std::uint8_t { start = 1, stop = 2, result = 3 };
inline constexpr std::uint8_t security_seed_level = 1;
inline constexpr std::uint8_t security_key_level = 2;

enum class Nrc : std::uint8_t {
  none = 0x00,  // not a response: "no objection"
  general_reject = 0x10,
  service_not_supported = 0x11,
  sub_function_not_supported = 0x12,
  incorrect_message_length = 0x13,
  response_too_long = 0x14,
  busy_repeat_request = 0x21,
  conditions_not_correct = 0x22,
  request_sequence_error = 0x24,
  request_out_of_range = 0x31,
  security_access_denied = 0x33,
  invalid_key = 0x35,
  exceeded_number_of_attempts = 0x36,
  required_time_delay_not_expired = 0x37,
  upload_download_not_accepted = 0x70,
  transfer_data_suspended = 0x71,
  general_programming_failure = 0x72,
  wrong_block_sequence_counter = 0x73,
  response_pending = 0x78,
  sub_function_not_supported_in_session = 0x7E,
  service_not_supported_in_session = 0x7F,
};

std::string_view service_name(std::uint8_t service);  // of the request; "unknown service"
std::string_view nrc_name(std::uint8_t nrc);          // as in ISO 14229-1, "unknown" for the rest
std::string describe_nrc(std::uint8_t nrc);           // "conditionsNotCorrect (0x22)"

}  // namespace selfcal::uds
