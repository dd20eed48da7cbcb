// Every negative response of the INS, against the order in which ISO 14229-1 (2013) has a server check a request: figure 5
// (service known, in this session), figure 6 (length, sub-function, its security, its sequence), figure 7 (without a
// sub-function), and then the figure of the service. Each row breaks one rule, or two of which the first must answer.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "tests/unit/sim_ins/diagnostics_fixture.hpp"

namespace selfcal::sim {
namespace {

enum class Before {
  nothing,
  seed,         // one was given out
  two_wrong,    // two wrong keys, and a seed
  three_wrong,  // the delay runs
  rotating,     // with a schedule, and two pages written
  uploading,    // of those two pages, the first block handed over
  uploaded,     // all of them
  not_erased,   // the inactive slot holds a set
};

struct Row {
  std::string_view sessions;  // D default, P programming, E extended: the row holds in each of these
  bool unlocked;
  Before before;
  std::string_view request;  // hexadecimal digits; {..} stand for what the test fills in
  Nrc expected;
  std::string_view clause;
};

constexpr auto none = Before::nothing;
constexpr auto unknown = Nrc::service_not_supported;
constexpr auto session = Nrc::service_not_supported_in_session;
constexpr auto length = Nrc::incorrect_message_length;
constexpr auto sub = Nrc::sub_function_not_supported;
constexpr auto security = Nrc::security_access_denied;
constexpr auto sequence = Nrc::request_sequence_error;
constexpr auto range = Nrc::request_out_of_range;
constexpr auto conditions = Nrc::conditions_not_correct;

constexpr Row rows[] = {
    // Figure 5: a service that the INS does not have, whatever else is wrong.
    {"DPE", false, none, "00", unknown, "figure 5: service"},
    {"DPE", false, none, "14FFFFFF", unknown, "figure 5: service"},
    {"DPE", false, none, "190201", unknown, "figure 5: service"},
    {"DPE", false, none, "2800", unknown, "figure 5: service"},
    {"DPE", false, none, "340044", unknown, "figure 5: service"},
    {"DPE", false, none, "8502", unknown, "figure 5: service"},
    {"DPE", false, none, "99", unknown, "figure 5: service"},
    {"PE", true, none, "99FFFF", unknown, "figure 5: service"},
    // Figure 5: not in the default session, before length, sub-function, sequence, identifier and range.
    {"D", false, none, "11", session, "figure 5: session before length"},
    {"D", false, none, "1101", session, "figure 5: session"},
    {"D", false, none, "1105", session, "figure 5: session before sub-function"},
    {"D", false, none, "110100", session, "figure 5: session before length"},
    {"D", false, none, "27", session, "figure 5: session before length"},
    {"D", false, none, "2701", session, "figure 5: session"},
    {"D", false, none, "2702{key}", session, "figure 5: session before sequence"},
    {"D", false, none, "2709", session, "figure 5: session before sub-function"},
    {"D", false, none, "2E", session, "figure 5: session before length"},
    {"D", false, none, "2EABCD00", session, "figure 5: session before identifier"},
    {"D", false, none, "2E0202{site}", session, "figure 5: session"},
    {"D", false, none, "31", session, "figure 5: session before length"},
    {"D", false, none, "3107", session, "figure 5: session before sub-function"},
    {"D", false, none, "3101ABCD", session, "figure 5: session before identifier"},
    {"D", false, none, "31010302", session, "figure 5: session"},
    {"D", false, none, "31030301", session, "figure 5: session before sequence"},
    {"D", false, none, "35", session, "figure 5: session before length"},
    {"D", false, none, "3500330000000000", session, "figure 5: session before format"},
    {"D", false, none, "3500440000000000001000", session, "figure 5: session"},
    {"D", false, none, "36", session, "figure 5: session before length"},
    {"D", false, none, "3601", session, "figure 5: session before sequence"},
    {"D", false, none, "37", session, "figure 5: session before sequence"},
    {"D", false, none, "3700", session, "figure 5: session before length"},
    // DiagnosticSessionControl
    {"DPE", false, none, "10", length, "figure 6: length"},
    {"DPE", false, none, "1000", sub, "figure 6: sub-function"},
    {"DPE", false, none, "1004", sub, "figure 6: sub-function"},
    {"DPE", false, none, "107F", sub, "figure 6: sub-function"},
    {"DPE", false, none, "100400", sub, "figure 6: sub-function before the service's length"},
    {"DPE", false, none, "100300", length, "9.2: total length"},
    // ECUReset
    {"PE", false, none, "11", length, "figure 6: length before security"},
    {"PE", false, none, "1100", sub, "figure 6: sub-function"},
    {"PE", false, none, "1103", sub, "figure 6: sub-function before security"},
    {"PE", true, none, "1104", sub, "figure 6: sub-function"},
    {"PE", false, none, "1101", security, "figure 6: security of the sub-function"},
    {"PE", false, none, "1102", security, "figure 6: security of the sub-function"},
    {"PE", false, none, "110100", security, "figure 6: security before the service's length"},
    {"PE", true, none, "110100", length, "9.3: total length"},
    // SecurityAccess
    {"PE", false, none, "27", length, "figure 6: length"},
    {"PE", false, none, "2700", sub, "figure 6: sub-function"},
    {"PE", false, none, "2703", sub, "figure 6: sub-function"},
    {"PE", true, none, "2742", sub, "figure 6: sub-function"},
    {"PE", false, none, "270300", sub, "figure 6: sub-function before the service's length"},
    {"PE", false, none, "270100", length, "9.4: total length"},
    {"PE", false, none, "2702{key}", sequence, "figure 6: a key without a seed"},
    {"PE", false, none, "270200", sequence, "figure 6: sequence before the service's length"},
    {"PE", true, none, "2702{key}", sequence, "figure 6: a key without a seed"},
    {"PE", false, Before::seed, "2702", length, "9.4: total length"},
    {"PE", false, Before::seed, "2702{key}00", length, "9.4: total length"},
    {"PE", false, Before::seed, "2702{key}", Nrc::invalid_key, "9.4: key"},
    {"PE", false, Before::two_wrong, "2702{key}", Nrc::exceeded_number_of_attempts, "9.4: attempts"},
    {"PE", false, Before::three_wrong, "2701", Nrc::required_time_delay_not_expired, "9.4: delay"},
    {"PE", false, Before::three_wrong, "270100", length, "9.4: length before delay"},
    {"PE", false, Before::three_wrong, "2702{key}", sequence, "figure 6: a key without a seed"},
    // ReadDataByIdentifier
    {"DPE", false, none, "22", length, "10.2: length"},
    {"DPE", false, none, "22F1", length, "10.2: length"},
    {"DPE", false, none, "22F18C02", length, "10.2: whole identifiers"},
    {"DPE", false, none, "22F18C0200", length, "10.2: more identifiers than the server takes at once"},
    {"DPE", false, none, "22ABCD", range, "10.2: identifier"},
    {"DPE", false, none, "220000", range, "10.2: identifier"},
    {"DPE", false, none, "220201", conditions, "10.2: conditions, no schedule yet"},
    {"DPE", false, none, "220211", conditions, "10.2: conditions, nothing in the slot"},
    // WriteDataByIdentifier
    {"PE", false, none, "2E", length, "10.7: length"},
    {"PE", false, none, "2E02", length, "10.7: length"},
    {"PE", false, none, "2E0202", length, "10.7: length before security"},
    {"PE", false, none, "2EABCD00", range, "10.7: identifier before security"},
    {"PE", false, none, "2EF18C00", range, "10.7: identifier that cannot be written"},
    {"PE", true, none, "2E0210{set}", range, "10.7: identifier that cannot be written"},
    {"PE", false, none, "2E0202{site}", security, "10.7: security"},
    {"PE", false, none, "2E020200", security, "10.7: security before total length"},
    {"PE", false, none, "2E0202{site nan}", security, "10.7: security before record"},
    {"PE", true, none, "2E020200", length, "10.7: total length of a known identifier"},
    {"PE", true, none, "2E0202{site}00", length, "10.7: total length"},
    {"PE", true, none, "2E0202{site nan}", range, "10.7: record"},
    {"PE", true, none, "2E0201{schedule}00", length, "10.7: total length"},
    {"PE", true, none, "2E020102{schedule tail}", length, "10.7: total length, two positions told, one sent"},
    {"PE", true, none, "2E02010000001388", range, "10.7: record, no position"},
    {"PE", true, none, "2E020101000013880006DDD10000000000001388", range, "10.7: record, 450.001 degrees"},
    {"PE", true, none, "2E0211{set}00", length, "10.7: total length"},
    {"PE", true, none, "2E0211{set crc}", range, "10.7: record"},
    {"PE", true, Before::rotating, "2E020200", length, "10.7: total length before conditions"},
    {"PE", true, Before::rotating, "2E0202{site nan}", range, "10.7: record before conditions"},
    {"PE", true, Before::rotating, "2E0202{site}", conditions, "10.7: conditions"},
    {"PE", true, Before::rotating, "2E0201{schedule}", conditions, "10.7: conditions"},
    {"PE", true, Before::rotating, "2E0211{set}", conditions, "10.7: conditions"},
    {"PE", true, Before::not_erased, "2E0211{set}", Nrc::general_programming_failure, "10.7: the write failed"},
    // RoutineControl
    {"PE", false, none, "31", length, "figure 6: length"},
    {"PE", false, none, "3100", sub, "figure 6: sub-function"},
    {"PE", false, none, "3104", sub, "figure 6: sub-function"},
    {"PE", false, none, "3104ABCD", sub, "figure 6: sub-function before identifier"},
    {"PE", false, none, "3101", length, "13.2: length"},
    {"PE", false, none, "310103", length, "13.2: length"},
    {"PE", false, none, "3101ABCD", range, "13.2: identifier before security"},
    {"PE", true, none, "3102ABCD", range, "13.2: identifier"},
    {"PE", false, none, "31010302", security, "13.2: security"},
    {"PE", false, none, "31010301", security, "13.2: security before total length"},
    {"PE", false, none, "31030301", security, "13.2: security before sequence"},
    {"PE", false, none, "31020302", security, "13.2: security before the sub-function for this routine"},
    {"PE", true, none, "31020302", sub, "13.2: sub-function for this routine, nothing to stop"},
    {"PE", true, none, "31030302", sub, "13.2: sub-function for this routine, no result"},
    {"PE", true, none, "31020303", sub, "13.2: sub-function for this routine"},
    {"PE", true, none, "3103030300", sub, "13.2: sub-function for this routine before total length"},
    {"PE", true, none, "31010301", length, "13.2: total length"},
    {"PE", true, none, "31010301000000", length, "13.2: total length"},
    {"PE", true, none, "3101030200", length, "13.2: total length"},
    {"PE", true, none, "3101030300", length, "13.2: total length"},
    {"PE", true, none, "31010304", length, "13.2: total length"},
    {"PE", true, none, "3102030100", length, "13.2: total length before sequence"},
    {"PE", true, none, "3103030400", length, "13.2: total length before sequence"},
    {"PE", true, none, "3101030312345678", range, "13.2: option, no such record"},
    {"PE", true, none, "310103040000003C07", range, "13.2: option, no such slot"},
    {"PE", true, Before::rotating, "3101030312345678", range, "13.2: option before conditions"},
    {"PE", true, Before::rotating, "310103040000003C07", range, "13.2: option before conditions"},
    {"PE", true, none, "31020301", sequence, "13.2: stop of a routine never started"},
    {"PE", true, none, "31030301", sequence, "13.2: result of a routine never started"},
    {"PE", true, none, "31020304", sequence, "13.2: stop of a routine never started"},
    {"PE", true, none, "31030304", sequence, "13.2: result of a routine never started"},
    {"PE", true, Before::rotating, "31020304", sequence, "13.2: stop of a routine never started, another one runs"},
    {"PE", true, none, "3101030100000001", conditions, "13.2: conditions, no schedule"},
    {"PE", true, Before::rotating, "3101030100000002", conditions, "13.2: conditions"},
    {"PE", true, Before::rotating, "31010302", conditions, "13.2: conditions"},
    {"PE", true, Before::rotating, "310103040000003C01", conditions, "13.2: conditions"},
    // RequestUpload
    {"PE", false, none, "35", length, "14.3: length"},
    {"PE", false, none, "35004400", length, "14.3: length"},
    {"PE", false, none, "3511440000000000001000", range, "14.3: data format"},
    {"PE", true, Before::rotating, "3500330000000010", range, "14.3: address and length of another width"},
    {"PE", true, Before::rotating, "350022000000", range, "14.3: address and length of another width"},
    {"PE", true, Before::rotating, "35004200000000001000", range, "14.3: address and length of another width"},
    {"PE", true, Before::rotating, "35004400000000000010", length, "14.3: total length"},
    {"PE", true, Before::rotating, "350044000000000000100000", length, "14.3: total length"},
    {"PE", false, none, "3500440000000000001000", range, "14.3: range, nothing stored"},
    {"PE", true, Before::rotating, "3500440000000100010000", range, "14.3: range, more than is stored"},
    {"PE", true, Before::rotating, "350044FFFFFFFFFFFFFFFF", range, "14.3: range"},
    {"PE", true, Before::rotating, "3500440000000000000000", range, "14.3: range, no bytes"},
    // TransferData
    {"PE", false, none, "36", length, "14.4: length"},
    {"PE", false, none, "360100", length, "14.4: length before sequence"},
    {"PE", false, none, "3601", sequence, "14.4: no upload"},
    {"PE", true, Before::uploading, "360200", length, "14.4: length"},
    {"PE", true, Before::uploading, "3603", Nrc::wrong_block_sequence_counter, "14.4: counter"},
    {"PE", true, Before::uploading, "3600", Nrc::wrong_block_sequence_counter, "14.4: counter"},
    {"PE", true, Before::uploaded, "36{next}", sequence, "14.4: one block too many"},
    // RequestTransferExit
    {"PE", false, none, "37", sequence, "14.5: no upload"},
    {"PE", false, none, "3700", length, "14.5: length before sequence"},
    {"PE", true, Before::uploading, "37", sequence, "14.5: not all was handed over"},
    {"PE", true, Before::uploaded, "3700", length, "14.5: length"},
    // TesterPresent
    {"DPE", false, none, "3E", length, "figure 6: length"},
    {"DPE", false, none, "3E01", sub, "figure 6: sub-function"},
    {"DPE", false, none, "3E0100", sub, "figure 6: sub-function before the service's length"},
    {"DPE", false, none, "3E0000", length, "9.6: total length"},
};
static_assert(std::size(rows) >= 80);

class NegativeResponses : public DiagnosticsTest {
 protected:
  static uds::Session session_of(char letter) {
    return letter == 'D' ? uds::Session::standard : letter == 'P' ? uds::Session::programming : uds::Session::extended;
  }

  void prepare(const Row& row, char letter) {
    if (letter != 'D' || row.before != Before::nothing) {
      ASSERT_EQ(nrc_of(uds::session_request(session_of(letter))), Nrc::none);
    }
    if (row.unlocked) {
      ASSERT_EQ(nrc_of(key_for(seed())), Nrc::none);
    }
    switch (row.before) {
      case Before::nothing: return;
      case Before::seed: wrong_keys(0); return;
      case Before::two_wrong: wrong_keys(2); return;
      case Before::three_wrong: wrong_keys(3); return;
      case Before::rotating: rotate(); return;
      case Before::uploading: upload(1); return;
      case Before::uploaded: upload(1000); return;
      case Before::not_erased:
        ASSERT_EQ(nrc_of(uds::write_request(did::coefficients_inactive, ins::encode(set_of(1)))), Nrc::none);
        return;
    }
  }
  // And a seed after them, while there are any.
  void wrong_keys(int count) {
    for (int k = 0; k < count; ++k) {
      ASSERT_FALSE(seed().empty());
      ASSERT_NE(nrc_of(uds::key_request(uds::Bytes(16, 0))), Nrc::none);
    }
    ASSERT_EQ(seed().empty(), count == 3);
  }
  void rotate() {
    ASSERT_EQ(nrc_of(schedule(20000)), Nrc::none);
    ASSERT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::none);
    run_for(6.5);  // 325 samples, 2 pages of 145
  }
  void upload(int blocks) {
    rotate();
    ASSERT_EQ(nrc_of(uds::upload_request(0, 2 * flash::page_bytes)), Nrc::none);
    while (blocks-- > 0 && nrc_of(uds::transfer_request(next_)) == Nrc::none) {
      ++next_;
    }
  }

  uds::Bytes bytes_of(std::string_view text) {
    uds::Bytes bytes;
    while (!text.empty()) {
      if (text[0] == '{') {
        const auto end = text.find('}');
        const uds::Bytes filled = filling(text.substr(1, end - 1));
        bytes.insert(bytes.end(), filled.begin(), filled.end());
        text.remove_prefix(end + 1);
        continue;
      }
      std::uint8_t byte = 0;
      std::from_chars(text.data(), text.data() + 2, byte, 16);
      bytes.push_back(byte);
      text.remove_prefix(2);
    }
    return bytes;
  }
  uds::Bytes filling(std::string_view what) {
    if (what == "key") {
      return uds::Bytes(16, 0);
    }
    if (what == "next") {
      return {next_};
    }
    if (what == "site" || what == "site nan") {
      return ins::encode(ins::SiteRecord{40.0, what == "site" ? 116.0 : std::nan(""), 50.0});
    }
    if (what == "schedule" || what == "schedule tail") {
      uds::Bytes record = ins::encode(ins::ScheduleRecord{{{0, 0, 5000}}, 5000});
      record.erase(record.begin(), record.begin() + (what == "schedule" ? 0 : 1));
      return record;
    }
    const auto record = ins::encode(set_of(1));
    uds::Bytes bytes(record.begin(), record.end());
    if (what == "set crc") {
      bytes[100] ^= 1U;
    }
    return bytes;
  }

  std::uint8_t next_ = 1;  // block of the upload
};

class NegativeResponse : public NegativeResponses, public testing::WithParamInterface<std::size_t> {};

// Each session of the row begins with a new INS.
TEST_P(NegativeResponse, IsThatOfTheStandard) {
  const Row& row = rows[GetParam()];
  for (const char letter : row.sessions) {
    switch_on_another();
    next_ = 1;
    ASSERT_NO_FATAL_FAILURE(prepare(row, letter));
    const uds::Session before = diagnostics_->session();
    const Nrc got = nrc_of(bytes_of(row.request));
    EXPECT_EQ(got, row.expected) << fmt::format("session {}, {}, {}: {}: 0x{:02X}", letter,
                                                row.unlocked ? "unlocked" : "locked", row.request, row.clause,
                                                static_cast<unsigned>(got));
    EXPECT_EQ(diagnostics_->session(), before) << row.request;
    EXPECT_EQ(diagnostics_->unlocked(), row.unlocked) << row.request;
    EXPECT_FALSE(diagnostics_->take_reset_request()) << row.request;
  }
}
INSTANTIATE_TEST_SUITE_P(Row, NegativeResponse, testing::Range(std::size_t{0}, std::size(rows)));

// What is refused changes nothing: after one block too many the last one comes again, byte for byte, and the exit.
TEST_F(NegativeResponses, AfterOneBlockTooManyTheLastComesAgain) {
  unlock();
  rotate();
  ASSERT_EQ(nrc_of(uds::upload_request(0, 2 * flash::page_bytes)), Nrc::none);
  uds::Bytes last;
  for (uds::Bytes answer = ask(uds::transfer_request(next_)); answer[0] == 0x76;
       answer = ask(uds::transfer_request(next_))) {
    last = answer;
    ++next_;
  }
  ASSERT_GT(last.size(), 2U);
  EXPECT_EQ(nrc_of(uds::transfer_request(next_)), Nrc::request_sequence_error);
  EXPECT_EQ(ask(uds::transfer_request(static_cast<std::uint8_t>(next_ - 1))), last);
  EXPECT_EQ(nrc_of(uds::transfer_exit_request()), Nrc::none);
}

}  // namespace
}  // namespace selfcal::sim
