#include "protocol/uds/services.hpp"

#include <fmt/format.h>

namespace selfcal::uds {

std::string_view service_name(std::uint8_t service) {
  switch (service) {
    case service::session_control: return "DiagnosticSessionControl";
    case service::ecu_reset: return "ECUReset";
    case service::read_data: return "ReadDataByIdentifier";
    case service::read_memory: return "ReadMemoryByAddress";
    case service::security_access: return "SecurityAccess";
    case service::write_data: return "WriteDataByIdentifier";
    case service::routine_control: return "RoutineControl";
    case service::request_upload: return "RequestUpload";
    case service::file_transfer: return "RequestFileTransfer";
    case service::transfer_data: return "TransferData";
    case service::transfer_exit: return "RequestTransferExit";
    case service::write_memory: return "WriteMemoryByAddress";
    case service::tester_present: return "TesterPresent";
    default: return "unknown service";
  }
}

std::string_view nrc_name(std::uint8_t nrc) {
  switch (static_cast<Nrc>(nrc)) {
    case Nrc::none: return "none";
    case Nrc::general_reject: return "generalReject";
    case Nrc::service_not_supported: return "serviceNotSupported";
    case Nrc::sub_function_not_supported: return "subFunctionNotSupported";
    case Nrc::incorrect_message_length: return "incorrectMessageLengthOrInvalidFormat";
    case Nrc::response_too_long: return "responseTooLong";
    case Nrc::busy_repeat_request: return "busyRepeatRequest";
    case Nrc::conditions_not_correct: return "conditionsNotCorrect";
    case Nrc::request_sequence_error: return "requestSequenceError";
    case Nrc::request_out_of_range: return "requestOutOfRange";
    case Nrc::security_access_denied: return "securityAccessDenied";
    case Nrc::invalid_key: return "invalidKey";
    case Nrc::exceeded_number_of_attempts: return "exceededNumberOfAttempts";
    case Nrc::required_time_delay_not_expired: return "requiredTimeDelayNotExpired";
    case Nrc::upload_download_not_accepted: return "uploadDownloadNotAccepted";
    case Nrc::transfer_data_suspended: return "transferDataSuspended";
    case Nrc::general_programming_failure: return "generalProgrammingFailure";
    case Nrc::wrong_block_sequence_counter: return "wrongBlockSequenceCounter";
    case Nrc::response_pending: return "requestCorrectlyReceived-ResponsePending";
    case Nrc::sub_function_not_supported_in_session: return "subFunctionNotSupportedInActiveSession";
    case Nrc::service_not_supported_in_session: return "serviceNotSupportedInActiveSession";
  }
  return "unknown";
}

std::string describe_nrc(std::uint8_t nrc) { return fmt::format("{} (0x{:02X})", nrc_name(nrc), nrc); }

}  // namespace selfcal::uds
