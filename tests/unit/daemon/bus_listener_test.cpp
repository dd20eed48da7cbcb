// "No link" has many causes; each is told by what else is on the bus.
#include "daemon/ins/bus_listener.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace selfcal {
namespace {

using testing::HasSubstr;
using testing::Not;

can::CanFrame with_id(std::uint32_t id, bool fd = false) {
  can::CanFrame frame;
  frame.id = id;
  frame.fd = fd;
  frame.size = 8;
  return frame;
}

std::string told(const std::vector<can::CanFrame>& frames, bool fd = false) {
  InsConfig config;
  config.fd = fd;
  Heard heard;
  for (const can::CanFrame& frame : frames) {
    count(frame, config, heard);
  }
  return why_silent(heard, config);
}

// What the daemon sends comes back to every other socket of the machine: it is no sign of life.
TEST(WhySilent, NothingButOurOwnRequests) {
  EXPECT_THAT(told({with_id(0x640), with_id(0x7DF)}), HasSubstr("no frame at all is on the bus"));
}

TEST(WhySilent, AnInsThatIsAliveAndDoesNotAnswer) {
  const std::string text = told({with_id(0x640), with_id(0x650), with_id(0x651)});
  EXPECT_THAT(text, HasSubstr("the INS is alive"));
  EXPECT_THAT(text, HasSubstr("it does not answer 0x640: check request_id and response_id (0x648)"));
}

TEST(WhySilent, ClassicAgainstFd) {
  // An INS on CAN FD takes classic requests, sends classic status frames, and answers with frames that nobody takes.
  EXPECT_THAT(told({with_id(0x650), with_id(0x648, true)}), HasSubstr("as CAN FD, and fd = false is configured"));
  // One on classic CAN does not even see our requests.
  EXPECT_THAT(told({with_id(0x650)}, true), HasSubstr("whether it takes CAN FD: fd = true is configured"));
  EXPECT_THAT(told({with_id(0x650)}), Not(HasSubstr("fd =")));
}

TEST(WhySilent, OthersOnly) {
  const std::string text = told({with_id(0x100), with_id(0x123)});
  EXPECT_THAT(text, HasSubstr("2 frames of others"));
  EXPECT_THAT(text, Not(HasSubstr("alive")));
}

}  // namespace
}  // namespace selfcal
