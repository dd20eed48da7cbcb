// What surrounds a run: the CAN bus with its errors, the disk, other INS, the journal.
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "daemon/host/journal.hpp"
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing_support::CalibrationRunTest;
using testing_support::FakeEstimators;
using testing_support::FakeIns;
using testing_support::Observer;

class RunSurroundingsTest : public CalibrationRunTest {
 protected:
  std::vector<std::string> texts(const std::string& kind) const {
    std::vector<std::string> found;
    const std::vector<EventRecord> events = store_->events(run_->record().id).value();
    for (const EventRecord& event : events) {
      if (event.kind == kind) {
        found.push_back(event.text);
      }
    }
    return found;
  }
};

TEST_F(RunSurroundingsTest, GraveErrorFramesAreWarnedOf) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  for (const can::BusEvent event : {can::BusEvent::error_passive, can::BusEvent::bus_off, can::BusEvent::restarted}) {
    ins_.on_bus_event(event);
  }
  ASSERT_EQ(observer_.warnings.size(), 3u);
  EXPECT_EQ(observer_.warnings[1], "fake0: " + std::string(can::name(can::BusEvent::bus_off)));
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST_F(RunSurroundingsTest, ManyErrorFramesAreFewLinesAndASum) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  for (int i = 0; i < 500; ++i) {
    ins_.on_bus_event(can::BusEvent::protocol_error);
  }
  EXPECT_EQ(texts("bus").size(), 1u);
  timers_.run_until([] { return false; }, 11s);
  ins_.on_bus_event(can::BusEvent::protocol_error);
  ASSERT_EQ(texts("bus").size(), 2u);
  EXPECT_THAT(texts("bus")[1], HasSubstr("501 times in this run"));
  EXPECT_TRUE(observer_.warnings.empty());
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_THAT(texts("bus").back(), HasSubstr("error frames in this run: 501"));
}

// 20 kHz for eleven days in each of the 19 positions are petabytes: no disk has them.
TEST_F(RunSurroundingsTest, ADiskTooSmallForTheRunIsSeenBeforeAnythingTurns) {
  ins_.sample_rate_hz = 20e3;
  schedule_.dwell_s.assign(schedule_.positions.size(), 1e6);
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("MiB free, a run of"));
  EXPECT_EQ(ins_.starts, 0);
}

TEST_F(RunSurroundingsTest, SpaceIsSetAsideBeforeThePagesCome) {
  begin();
  ASSERT_TRUE(timers_.run_until([&] { return ins_.pages_read.size() == 1; }, 100s));
  struct stat info {};
  ASSERT_EQ(stat((folder_ / "pages").c_str(), &info), 0);
  const auto allocated = static_cast<std::uint64_t>(info.st_blocks) * 512;
  EXPECT_LE(static_cast<std::uint64_t>(info.st_size), 2u * 4096);  // the file itself holds what has come
  if (allocated <= 2u * 4096) {
    GTEST_SKIP() << "this file system sets nothing aside";
  }
  EXPECT_GE(allocated, FakeIns::pages * 4096u);
}

// The key of the tests stands for secrets; as text it would be in hexadecimal or as bytes.
TEST_F(RunSurroundingsTest, NoSecretInJournalOrStory) {
  ins_.key = {0xDE, 0xAD, 0xBE, 0xEF, 0x10, 0x32, 0x54, 0x76, 0x98, 0xBA, 0xDC, 0xFE, 0x5A, 0xA5, 0x0F, 0xF0};
  key_ = ins_.key;
  testing::internal::CaptureStderr();
  begin();
  const State ended = end();
  key_[3] = 0xEE;  // and where unlocking fails
  observer_.finished = 0;
  begin();
  const State refused = end();
  std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(ended, State::completed);
  EXPECT_EQ(refused, State::failed);
  for (const RunId run : {1, 2}) {
    const std::vector<EventRecord> events = store_->events(run).value();
    for (const EventRecord& event : events) {
      said += event.text;
    }
  }
  EXPECT_THAT(said, HasSubstr("invalidKey"));  // it is this text that is looked at
  std::transform(said.begin(), said.end(), said.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* secret : {"deadbe", "de ad be", "de, ad", "0xde", "10325476", "09090900"}) {
    EXPECT_THAT(said, Not(HasSubstr(secret)));
  }
}

TEST(Journal, FieldsAreStructured) {
  const auto lines = journal::entry(journal::Level::warning, "text",
                                    {7, "bench", "S1", "rotating", 0x35, "b1", "estimate", "a.h5", "77ab"});
  for (const char* line : {"MESSAGE=text", "PRIORITY=4", "SELFCAL_RUN=7", "SELFCAL_INS=bench", "SELFCAL_SERIAL=S1",
                           "SELFCAL_STATE=rotating", "SELFCAL_NRC=0x35", "SELFCAL_BATCH=b1", "SELFCAL_STEP=estimate",
                           "SELFCAL_TASK=a.h5", "SELFCAL_KEY=77ab"}) {
    EXPECT_THAT(lines, Contains(line));
  }
  EXPECT_THAT(lines, Contains(std::string("SYSLOG_IDENTIFIER=") + program_invocation_short_name));
  EXPECT_THAT(journal::entry(journal::Level::info, "text", {}), Not(Contains(HasSubstr("SELFCAL_"))));
}

// Four INS on one loop, one of them gone in rotation: the others end when they would have ended alone.
TEST_F(RunSurroundingsTest, AStuckInsCostsTheOthersNothing) {
  begin();
  ASSERT_EQ(end(), State::completed);
  const SteadyTime alone = timers_.now();  // time began at 0

  struct Bench {
    explicit Bench(Timers& timers) : ins(timers), estimators(timers) {}
    FakeIns ins;
    FakeEstimators estimators;
    Observer observer;
    std::unique_ptr<CalibrationRun> run;
    SteadyTime ended{};
  };
  const SteadyTime begun = timers_.now();
  std::vector<std::unique_ptr<Bench>> benches;
  for (int i = 0; i < 4; ++i) {
    Bench& bench = *benches.emplace_back(std::make_unique<Bench>(timers_));
    bench.ins.serial = "FAKE-" + std::to_string(i + 10);
    bench.ins.key = key_;
    RunRecord record;
    record.ins = "bench" + std::to_string(i);
    record.id = *store_->create_run(record);
    const std::filesystem::path folder = folder_ / record.ins;
    std::filesystem::create_directory(folder);
    bench.run =
        std::make_unique<CalibrationRun>(RunContext{timers_, *store_, bench.ins, bench.estimators, bench.observer},
                                         config_, schedule_, key_, record, folder);
    bench.run->begin();
  }
  ASSERT_TRUE(timers_.run_until([&] { return benches[3]->run->record().state == State::rotating; }, 100s));
  benches[3]->ins.dead = true;
  const auto all_ended = [&] {
    bool all = true;
    for (auto& bench : benches) {
      const bool over = bench->observer.finished > 0;
      if (over && bench->ended == SteadyTime{}) {
        bench->ended = timers_.now();
      }
      all = all && over;
    }
    return all;
  };
  ASSERT_TRUE(timers_.run_until(all_ended, 3600s));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(benches[static_cast<std::size_t>(i)]->run->record().state, State::completed);
    // The moment of the end is read after the next event, up to a poll (0.5 s) later.
    EXPECT_LE(benches[static_cast<std::size_t>(i)]->ended - begun, alone + 1s);
  }
  EXPECT_EQ(benches[3]->run->record().state, State::failed);
}

}  // namespace
}  // namespace selfcal
