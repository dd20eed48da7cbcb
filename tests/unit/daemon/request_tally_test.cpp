// What a request is called in messages: by the words of the INS's profile, whatever its numbers.
#include <gtest/gtest.h>

#include "daemon/ins/request_tally.hpp"
#include "protocol/profile/read_profile.hpp"
#include "protocol/uds/messages.hpp"

namespace selfcal {
namespace {

profile::ProfilePtr example() {
  return profile::load_profile(SELFCAL_SOURCE_DIR "/config/profiles/example.toml").value();
}

TEST(RequestName, HasTheWordsOfTheProfile) {
  const auto own = profile::built_in(), other = example();
  EXPECT_EQ(request_name(*own, uds::read_request(0x0210)), "ReadDataByIdentifier coefficients.in_force");
  EXPECT_EQ(request_name(*other, uds::read_request(0xFD30)), "ReadDataByIdentifier coefficients.in_force");
  // The number of our own INS's means nothing to another one.
  EXPECT_EQ(request_name(*other, uds::read_request(0x0210)), "ReadDataByIdentifier 0x0210");
  EXPECT_EQ(request_name(*other, uds::write_request(0xFD11, uds::Bytes{1, 2})), "WriteDataByIdentifier schedule");
  EXPECT_EQ(request_name(*other, uds::routine_request(uds::RoutineAction::start, 0xE010)),
            "RoutineControl start erase");
  EXPECT_EQ(request_name(*other, uds::routine_request(uds::RoutineAction::stop, 0x0302)), "RoutineControl stop 0x0302");
  EXPECT_EQ(request_name(*other, uds::transfer_request(7)), "TransferData");
}

TEST(RequestName, KnowsTheFieldsOfASet) {
  const auto memory = profile::load_profile(SELFCAL_SOURCE_DIR "/config/profiles/memory.toml").value();
  EXPECT_EQ(request_name(*memory, uds::write_request(0x4102, uds::Bytes{1})),
            "WriteDataByIdentifier coefficients.accel_bias_y");
}

// The service that goes over the bus, not the one that the service asks by.
TEST(RequestName, KnowsWhatStandsInMemory) {
  const auto profile = profile::load_profile(SELFCAL_SOURCE_DIR "/config/profiles/addresses.toml").value();
  EXPECT_EQ(request_name(*profile, uds::read_request(*profile->state.did)), "ReadMemoryByAddress state");
  EXPECT_EQ(request_name(*profile, uds::write_request(*profile->schedule.did, uds::Bytes{1})),
            "WriteMemoryByAddress schedule");
}

TEST(RequestTally, TellsWhatFailedMostOften) {
  RequestTally tally(example());
  EXPECT_EQ(tally.words(), "");
  const uds::Bytes state = uds::read_request(0xFD10);
  tally.asked(state);
  tally.failed(state, "vcan0: no answer");
  tally.asked(uds::transfer_request(1));
  EXPECT_EQ(tally.words(), "ReadDataByIdentifier state, asked once (vcan0: no answer)");
  tally.forget();
  EXPECT_EQ(tally.words(), "");
}

}  // namespace
}  // namespace selfcal
