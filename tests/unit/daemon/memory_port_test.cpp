// Whole calibrations of a fake INS whose records stand in its memory, in simulated time: every record in parts of a few bytes; and
// each answer that makes no sense ends the run with a line that names record and address, the old set in force.
#include <map>

#include "daemon/ins/memory_port.hpp"
#include "protocol/profile/built_in_text.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;

constexpr std::uint32_t longest_read = 32, longest_write = 60;

void replace(std::string& text, std::string_view from, std::string_view with) {
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), with);
}

// Our own INS's, with addresses where it has identifiers; but for the schedule, whose record has no length of its own.
profile::ProfilePtr in_memory() {
  std::string text(profile::built_in_text());
  replace(text, "serial = 0xF18C ", "serial = { memory = 0x1000, bytes = 20 } ");
  replace(text, "software = 0xF195 ", "software = { memory = 0x1100, bytes = 40 } ");
  replace(text, "did = 0x0200", "memory = 0x1200");
  replace(text, "did = 0x0202", "memory = 0x1300");
  replace(text, "did = 0x0220", "memory = 0x1400");
  replace(text, "did = 0x0221", "memory = 0x1500");
  replace(text, "in_force = 0x0210", "in_force = { memory = 0x2000 }");
  replace(text, "inactive = 0x0211", "inactive = { memory = 0x3000 }");
  replace(text, "factory = 0x0212", "factory = { memory = 0x4000 }");
  replace(text, "[upload]",
          "[memory]\naddress_bytes = 2\nsize_bytes = 1\nlongest = 32\nlongest_write = 60\n\n[upload]");
  auto profile = profile::parse_profile(text, "in_memory.toml");
  return profile ? *profile : throw std::runtime_error(profile.error().message);
}

// The fake INS behind its memory: two bytes of address, one of size.
class MemoryIns : public InsPort {
 public:
  MemoryIns(Timers& timers, FakeIns& ins) : timers_(timers), ins_(ins) {}

  void request(std::span<const std::uint8_t> payload, std::size_t longest_answer,
               std::function<void(Answer<Bytes>)> done) override {
    if (payload[0] == 0x23) {
      return read(payload, std::move(done));
    }
    if (payload[0] == 0x3D) {
      return write(payload, std::move(done));
    }
    by_identifier += payload[0] == 0x22 || payload[0] == 0x2E;
    ins_.request(payload, longest_answer, std::move(done));
  }
  void cancel() override { ins_.cancel(); }
  void reopen() override { ins_.reopen(); }
  void keep_session(bool keep) override { ins_.keep_session(keep); }
  void take_timings(const uds::SessionTimings& stated) override { ins_.take_timings(stated); }
  std::uint64_t lost_frames() const override { return 0; }
  std::string_view interface() const override { return "fake0"; }

  int reads = 0, writes = 0, by_identifier = 0;
  std::function<void(std::span<const std::uint8_t> request, Answer<Bytes>& answer)> alter;

 private:
  struct Place {
    std::uint16_t did;
    std::size_t bytes;
    std::uint8_t fill;
  };
  static const std::map<std::uint16_t, Place>& places() {
    static const std::map<std::uint16_t, Place> all{{0x1000, {ins::did::serial_number, 20, ' '}},
                                                    {0x1100, {ins::did::software_version, 40, 0}},
                                                    {0x1200, {ins::did::state, 19, 0}},
                                                    {0x1300, {ins::did::site, 24, 0}},
                                                    {0x1400, {ins::did::raw_data_directory, 25, 0}},
                                                    {0x1500, {ins::did::sample_format, 38, 0}},
                                                    {0x2000, {ins::did::coefficients_in_force, 260, 0}},
                                                    {0x3000, {ins::did::coefficients_inactive, 260, 0}},
                                                    {0x4000, {ins::did::coefficients_factory, 260, 0}}};
    return all;
  }
  using Request = std::span<const std::uint8_t>;
  void tell(const Bytes& request, Answer<Bytes> answer, const std::function<void(Answer<Bytes>)>& done) const {
    if (alter) {
      alter(request, answer);
    }
    done(std::move(answer));
  }

  void read(Request request, std::function<void(Answer<Bytes>)> done) {
    ++reads;
    ASSERT_EQ(request.size(), 5U);
    ASSERT_EQ(request[1], 0x12);
    const std::size_t address = request[2] << 8U | request[3], size = request[4];
    ASSERT_LE(size, longest_read);
    const auto place = std::prev(places().upper_bound(static_cast<std::uint16_t>(address)));
    const std::size_t at = address - place->first;
    ASSERT_LE(at + size, place->second.bytes);
    const Bytes asked(request.begin(), request.end());
    ins_.request(uds::read_request(place->second.did), 512,
                 [this, asked, at, size, place = place->second, done = std::move(done)](Answer<Bytes> told) {
                   if (told) {
                     Bytes record(told->begin() + 3, told->end());
                     record.resize(std::max(record.size(), place.bytes), place.fill);
                     told = Bytes{0x63};
                     told->insert(told->end(), record.begin() + static_cast<std::ptrdiff_t>(at),
                                  record.begin() + static_cast<std::ptrdiff_t>(at + size));
                   }
                   tell(asked, std::move(told), done);
                 });
  }

  void write(Request request, std::function<void(Answer<Bytes>)> done) {
    ++writes;
    ASSERT_GT(request.size(), 5U);
    const std::size_t size = request[4], address = request[2] << 8U | request[3];
    ASSERT_EQ(request.size(), 5 + size);
    ASSERT_LE(size, longest_write);
    const auto place = std::prev(places().upper_bound(static_cast<std::uint16_t>(address)));
    ASSERT_EQ(address, place->first + (address == place->first ? 0 : written_.size()));  // in order
    if (address == place->first) {
      written_.clear();
    }
    written_.insert(written_.end(), request.begin() + 5, request.end());
    const Bytes asked(request.begin(), request.end());
    const Bytes echo{0x7D, request[1], request[2], request[3], request[4]};
    if (written_.size() < place->second.bytes) {
      timers_.after(std::chrono::milliseconds(1),
                    [this, asked, echo, done = std::move(done)] { tell(asked, echo, done); });
      return;
    }
    ins_.request(uds::write_request(place->second.did, written_), 128,
                 [this, asked, echo, done = std::move(done)](Answer<Bytes> told) {
                   tell(asked, told ? Answer<Bytes>(echo) : std::move(told), done);
                 });
  }

  Timers& timers_;
  FakeIns& ins_;
  Bytes written_;
};

class MemoryPortTest : public CalibrationRunTest {
 protected:
  MemoryPortTest() { config_.profile = in_memory(); }
  ~MemoryPortTest() override { run_.reset(); }  // before its port

  InsPort& port() override {
    port_.reset();
    port_ =
        std::make_unique<MemoryPort>(std::shared_ptr<InsPort>(std::shared_ptr<InsPort>(), &memory_), config_.profile);
    return *port_;
  }
  // From the answer to a request on that begins so, each such answer is changed.
  void change(const Bytes& begins, const std::function<void(Answer<Bytes>&)>& how) {
    memory_.alter = [=](std::span<const std::uint8_t> request, Answer<Bytes>& answer) {
      if (std::ranges::equal(request.first(std::min(request.size(), begins.size())), begins)) {
        how(answer);
      }
    };
  }
  void fails(const std::string& words) {
    EXPECT_EQ(end(), State::failed);
    EXPECT_THAT(reason(), HasSubstr(words));
    EXPECT_TRUE(reason().starts_with("fake0: ")) << reason();
    EXPECT_EQ(reason().find('\n'), std::string::npos) << reason();
    EXPECT_TRUE(old_set_in_force());
  }

  MemoryIns memory_{timers_, ins_};
  std::unique_ptr<MemoryPort> port_;
};

TEST_F(MemoryPortTest, AWholeCalibrationByAddresses) {
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.in_force().version, 1U);
  EXPECT_EQ(run_->record().serial, "FAKE-1");  // told with blanks behind it
  EXPECT_GT(memory_.reads, 9 * 3);             // a set is nine parts
  EXPECT_EQ(memory_.writes, 5);                // and 260 bytes are written in five
  EXPECT_EQ(memory_.by_identifier, 1);         // the schedule
}

TEST_F(MemoryPortTest, ARefusalNamesRecordAndAddress) {
  change({0x23, 0x12, 0x14, 0x00}, [](Answer<Bytes>& answer) {
    answer = tl::unexpected(PortError{PortError::Kind::negative, 0x31, "fake0: INS refused ReadMemoryByAddress"});
  });
  begin();
  fails("fake0: directory at 0x1400: INS refused ReadMemoryByAddress");
}

TEST_F(MemoryPortTest, AnAnswerOfAnotherLengthIsNoRecord) {
  change({0x23, 0x12, 0x12}, [](Answer<Bytes>& answer) { answer->pop_back(); });
  begin();
  fails("state at 0x1200: ReadMemoryByAddress: 18 bytes in answer to a request for 19");
}

TEST_F(MemoryPortTest, ALongerAnswerIsNone) {
  change({0x23, 0x12, 0x15, 0x20}, [](Answer<Bytes>& answer) { answer->push_back(0); });
  begin();
  fails("sample_format at 0x1520: ReadMemoryByAddress: 7 bytes in answer to a request for 6");
}

TEST_F(MemoryPortTest, TheEchoOfAnotherAddressIsNoAnswerToAWrite) {
  change({0x3D, 0x12, 0x30, 0x3C}, [](Answer<Bytes>& answer) { (*answer)[3] = 0x78; });
  begin();
  fails("coefficients.inactive at 0x303C: WriteMemoryByAddress: byte 3 of the response is 0x78, the request had 0x3C");
}

TEST_F(MemoryPortTest, TheEchoOfAnotherSizeIsNone) {
  change({0x3D}, [](Answer<Bytes>& answer) { --answer->back(); });
  begin();
  fails("coefficients.inactive at 0x3000: WriteMemoryByAddress: byte 4 of the response is 0x3B");
}

TEST_F(MemoryPortTest, AWriteThatIsRefusedInTheMiddleIsTold) {
  change({0x3D, 0x12, 0x30, 0x78}, [](Answer<Bytes>& answer) {
    answer = tl::unexpected(PortError{PortError::Kind::negative, 0x72, "fake0: INS refused WriteMemoryByAddress"});
  });
  begin();
  fails("coefficients.inactive at 0x3078: INS refused WriteMemoryByAddress");
}

// Another tester's answer may come first: the record is asked for again, as one with an identifier would be.
TEST_F(MemoryPortTest, OneAnswerThatMakesNoSenseIsAskedForAgain) {
  int wrong = 0;
  change({0x23, 0x12, 0x12}, [&](Answer<Bytes>& answer) {
    if (wrong++ < 3) {
      answer->push_back(0);
    }
  });
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST_F(MemoryPortTest, ALostLinkAmidARecordIsSurvived) {
  bool lost = false;
  change({0x3D, 0x12, 0x30, 0x78}, [&](Answer<Bytes>& answer) {
    if (!std::exchange(lost, true)) {
      answer = tl::unexpected(PortError{PortError::Kind::link, 0, "fake0: no answer"});
    }
  });
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.in_force().version, 1U);
}

TEST_F(MemoryPortTest, AnAbortForgetsTheRecordInHand) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  run_->abort("test");
  EXPECT_EQ(end(), State::aborted);
  EXPECT_TRUE(old_set_in_force());
}

}  // namespace
}  // namespace selfcal
