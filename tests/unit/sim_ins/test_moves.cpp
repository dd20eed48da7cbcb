// An INS that is told each position by itself: our own one's profile with a move in the place of the schedule.
#include <gtest/gtest.h>

#include <string>

#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/profile/records.hpp"
#include "tests/unit/sim_ins/diagnostics_fixture.hpp"

namespace selfcal::sim {
namespace {

constexpr std::uint16_t move_did = 0x0230;

profile::ProfilePtr with_moves() {
  std::string text(profile::built_in_text());
  const std::string bytes = "bytes = 19\n";
  text.replace(text.find(bytes), bytes.size(), "bytes = 20\n");
  const std::size_t begin = text.find("[schedule]"), end = text.find("[site]");
  text.replace(begin, end - begin,
               "fields.gimbal_moving = { at = 19, type = \"u8\" }\n\n"
               "[move]\ndid = 0x0230\nthere = \"state\"\nbytes = 8\n"
               "fields.outer = { at = 0, type = \"i32\" }\nfields.inner = { at = 4, type = \"i32\" }\n\n");
  return profile::parse_profile(text, "moves.toml").value();
}

class Moves : public DiagnosticsTest {
 protected:
  Moves() : DiagnosticsTest(with_moves()) {
    instrument_->turn_by_moves(CommandedGimbal(small(), 1, {}, {}));
    power_cycle();
  }
  uds::Bytes move(std::int32_t outer_mdeg, std::int32_t inner_mdeg) {
    return uds::write_request(move_did, profile::encode(*profile_, ins::MoveRecord{outer_mdeg, inner_mdeg}).value());
  }
  ins::StateRecord state() {
    return profile::decode_state(*profile_, *uds::read_read_response(ask(uds::read_request(did::state)), did::state))
        .value();
  }
};

TEST_F(Moves, AMoveIsRefusedLikeAnyWrite) {
  EXPECT_EQ(nrc_of(move(0, 0)), Nrc::service_not_supported_in_session);
  ASSERT_EQ(nrc_of(uds::session_request(uds::Session::extended)), Nrc::none);
  EXPECT_EQ(nrc_of(move(0, 0)), Nrc::security_access_denied);
  unlock();
  EXPECT_EQ(nrc_of(move(0, 360'001)), Nrc::request_out_of_range);
  uds::Bytes shorter = move(0, 0);
  shorter.pop_back();
  EXPECT_EQ(nrc_of(shorter), Nrc::incorrect_message_length);
  EXPECT_EQ(nrc_of(uds::read_request(move_did)), Nrc::request_out_of_range);  // it is only written
  EXPECT_EQ(nrc_of(schedule(20000)), Nrc::request_out_of_range);              // there is none
}

TEST_F(Moves, OneAtATime) {
  unlock();
  EXPECT_EQ(nrc_of(move(90'000, 0)), Nrc::none);
  EXPECT_TRUE(state().moving);
  EXPECT_EQ(nrc_of(move(0, 0)), Nrc::conditions_not_correct);
  run_for(6.0);
  EXPECT_FALSE(state().moving);
  EXPECT_EQ(nrc_of(move(0, 0)), Nrc::none);
}

TEST_F(Moves, ItRecordsFromTheStartToTheStop) {
  unlock();
  ASSERT_EQ(nrc_of(move(90'000, 0)), Nrc::none);
  run_for(6.0);
  ASSERT_EQ(nrc_of(start(routine::self_calibration, 7)), Nrc::none);
  run_for(3.0);
  ASSERT_EQ(nrc_of(move(0, 0)), Nrc::none);
  run_for(2.0);
  EXPECT_EQ(state().state, ins::State::rotating);
  EXPECT_TRUE(state().moving);
  ASSERT_EQ(nrc_of(uds::routine_request(uds::RoutineAction::stop, routine::self_calibration)), Nrc::none);
  EXPECT_EQ(state().state, ins::State::complete);
  EXPECT_FALSE(state().moving);
  const auto directory = profile::decode_directory(
      *profile_, *uds::read_read_response(ask(uds::read_request(did::raw_data_directory)), did::raw_data_directory));
  ASSERT_TRUE(directory);
  EXPECT_EQ(directory->run_id, 7U);
  EXPECT_TRUE(directory->complete);
  // 5 s at 50 Hz, and the answer to the start, which waits until its FLASH has made room: less than half a second.
  EXPECT_THAT(directory->samples, testing::AllOf(testing::Ge(250U), testing::Le(275U)));
  EXPECT_EQ(directory->pages_written, 2U);
  EXPECT_EQ(directory->pages_expected, 0U);  // nobody knew
}

}  // namespace
}  // namespace selfcal::sim
