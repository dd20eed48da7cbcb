// An INS, or somebody between it and the daemon, that answers what makes no sense or does not answer at all: the run ends
// in its time, says at what, and the coefficients are the old ones or the new ones.
#include <algorithm>

#include "daemon/run/ins_checks.hpp"
#include "daemon/run/state_budget.hpp"
#include "protocol/byte_order.hpp"
#include "protocol/uds/messages.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/own_ins/records.hpp"
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;
using testing_support::new_value;
using Request = std::span<const std::uint8_t>;

bool begins(Request request, const Bytes& with) {
  return request.size() >= with.size() && std::equal(with.begin(), with.end(), request.begin());
}

// How the request for each of these begins.
Bytes read_of(std::uint16_t did) { return uds::read_request(did); }
Bytes start_of(std::uint16_t routine) { return uds::routine_request(uds::RoutineAction::start, routine); }

class HostileInsTest : public CalibrationRunTest {
 protected:
  // 100 s, as long as the fake takes, and its 20 pages; one every five seconds.
  HostileInsTest() {
    schedule_ = Schedule{{{0.0, 0.0}, {90.0, 0.0}}, {47.5, 47.5}, 5.0};
    ins_.sample_rate_hz = FakeIns::pages * flash::samples_per_page / FakeIns::rotation_s;
  }
  double seconds(SteadyTime from) const { return std::chrono::duration<double>(timers_.now() - from).count(); }
  template <typename Record>
  void alter_record(std::uint16_t did, Record (*decode)(ins::ByteView), std::function<void(Record&)> change) {
    ins_.alter = [=, this](Request request, Answer<Bytes>& answer) {
      if (answer && begins(request, read_of(did)) && altering_) {
        Record record = decode(Request(*answer).subspan(3));
        change(record);
        answer = uds::read_response(did, ins::encode(record));
      }
    };
  }
  void alter_directory(std::function<void(ins::DirectoryRecord&)> change) {
    alter_record<ins::DirectoryRecord>(
        ins::did::raw_data_directory, [](ins::ByteView bytes) { return *ins::decode_directory(bytes); }, change);
  }
  void alter_format(std::function<void(ins::SampleFormatRecord&)> change) {
    alter_record<ins::SampleFormatRecord>(
        ins::did::sample_format, [](ins::ByteView bytes) { return *ins::decode_sample_format(bytes); }, change);
  }
  void alter_state(std::function<void(ins::StateRecord&)> change) {
    alter_record<ins::StateRecord>(
        ins::did::state, [](ins::ByteView bytes) { return *ins::decode_state(bytes); }, change);
  }
  bool altering_ = true;
};

// --- requests that are never answered -------------------------------------------------------------------------------

struct Silence {
  const char* name;
  State state;
  Bytes request;
  const char* words;  // in the reason
  const char* holds;
};

class NeverAnswered : public HostileInsTest, public testing::WithParamInterface<Silence> {};

// The INS is alive and answers everything else: the link is found again for ever, and the run ends nevertheless.
TEST_P(NeverAnswered, EndsTheRunInItsBudget) {
  ins_.ignores = [](Request request) { return begins(request, GetParam().request); };
  begin();
  ASSERT_TRUE(until(GetParam().state));
  SteadyTime entered = timers_.now();
  // Pages that came before the request that is not answered are progress.
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("no progress in"));
  EXPECT_THAT(reason(), HasSubstr(GetParam().words));
  EXPECT_THAT(reason(), HasSubstr(GetParam().holds));
  const double page_s = flash::samples_per_page / ins_.sample_rate_hz;
  // Then a gimbal or a check is stopped and the session ended.
  const double ways_to_end_s = budget_s(State::stopping, config_, page_s) + 2.0;
  EXPECT_LE(seconds(entered), budget_s(GetParam().state, config_, page_s) + ways_to_end_s);
  EXPECT_NE(ins_.state(), ins::State::rotating);
  EXPECT_FALSE(ins_.unlocked());
  EXPECT_LE(ins_.in_force().version, 1u);
}

const char* const old_set = "the old set is in force";
INSTANTIATE_TEST_SUITE_P(
    Run, NeverAnswered,
    testing::Values(
        Silence{"schedule", State::scheduling, {0x2E, 0x02, 0x01}, "WriteDataByIdentifier", old_set},
        Silence{"start", State::starting, start_of(ins::routine::self_calibration), "RoutineControl start", old_set},
        Silence{"upload", State::rotating, {0x35}, "RequestUpload", old_set},
        Silence{"transfer", State::rotating, {0x36}, "TransferData", old_set},
        Silence{"erase", State::erasing, start_of(ins::routine::erase_inactive), "RoutineControl start", old_set},
        Silence{"write", State::writing, {0x2E, 0x02, 0x11}, "WriteDataByIdentifier", old_set},
        Silence{"commit", State::committing, start_of(ins::routine::commit_coefficients), "RoutineControl start",
                "the commit was asked for and not confirmed"},
        Silence{"reset", State::resetting, {0x11}, "ECUReset", "the new set is committed"}),
    [](const auto& tested) { return std::string(tested.param.name); });

// Response-pending keeps a request going for a minute at a time.
TEST_F(HostileInsTest, ARequestThatIsPendingForEverEndsInTheBudgetToo) {
  ins_.ignores = [](Request request) { return begins(request, start_of(ins::routine::erase_inactive)); };
  ins_.given_up_after = 3600s;
  begin();
  ASSERT_TRUE(until(State::erasing));
  const SteadyTime entered = timers_.now();
  EXPECT_EQ(end(), State::failed);
  EXPECT_LE(seconds(entered), budget_s(State::erasing, config_, 0.0) + 2.5);
  EXPECT_THAT(reason(), HasSubstr("asked once"));
}

// An abort does not hang either.
TEST_F(HostileInsTest, AStopThatIsNeverAnsweredEnds) {
  ins_.ignores = [](Request request) {
    return begins(request, uds::routine_request(uds::RoutineAction::stop, ins::routine::self_calibration));
  };
  begin();
  ASSERT_TRUE(until(State::rotating));
  run_->abort("test");
  const SteadyTime asked = timers_.now();
  EXPECT_EQ(end(), State::failed);
  EXPECT_LE(seconds(asked), budget_s(State::stopping, config_, 0.0) + 2.5);
}

// Pages come, the last one excepted, and the INS says that it is rotating: no page more is no progress.
TEST_F(HostileInsTest, ARotationThatDoesNotEndIsEnded) {
  alter_state([this](ins::StateRecord& record) {
    if (ins_.starts > 0 && ins_.stops == 0) {
      record.state = ins::State::rotating;
    }
  });
  auto state_altered = ins_.alter;
  ins_.alter = [=](Request request, Answer<Bytes>& answer) {
    state_altered(request, answer);
    if (answer && begins(request, read_of(ins::did::raw_data_directory))) {
      ins::DirectoryRecord record = *ins::decode_directory(Request(*answer).subspan(3));
      record.complete = false;
      answer = uds::read_response(ins::did::raw_data_directory, ins::encode(record));
    }
  };
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("no progress in"));
  EXPECT_EQ(ins_.stops, 1);
}

// --- values that cannot be ------------------------------------------------------------------------------------------

struct Lie {
  const char* name;
  std::function<void(ins::DirectoryRecord&)> directory;
  std::function<void(ins::SampleFormatRecord&)> format;
  const char* words;
};

class Lies : public HostileInsTest, public testing::WithParamInterface<Lie> {};

TEST_P(Lies, AreRefusedByNameAndValue) {
  GetParam().directory ? alter_directory(GetParam().directory) : alter_format(GetParam().format);
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr(GetParam().words));
  EXPECT_NE(ins_.state(), ins::State::rotating);
  EXPECT_TRUE(old_set_in_force());
}

INSTANTIATE_TEST_SUITE_P(
    Run, Lies,
    testing::Values(
        Lie{"rate_1e_3", {}, [](auto& r) { r.sample_rate_hz = 1e-3; }, "sample rate in Hz is 0.001"},
        Lie{"rate_1e_300", {}, [](auto& r) { r.sample_rate_hz = 1e-300; }, "sample rate in Hz is 1e-300"},
        Lie{"rate_1e300", {}, [](auto& r) { r.sample_rate_hz = 1e300; }, "sample rate in Hz is 1e+300"},
        Lie{"no_samples_a_page", {}, [](auto& r) { r.samples_per_page = 0; }, "samples of a page is 0"},
        Lie{"many_samples_a_page", {}, [](auto& r) { r.samples_per_page = 65535; }, "samples of a page is 65535"},
        Lie{"other_pages", {}, [](auto& r) { r.page_bytes = 8192; }, "bytes of a page is 8192"},
        Lie{"angle_scale", {}, [](auto& r) { r.delta_theta_lsb_rad = 1e9; }, "angle per count in rad is 1e+09"},
        Lie{"complete_at_once", [](auto& r) { r.complete = true; }, {}, "directory: complete with"},
        Lie{"samples_2_63", [](auto& r) { r.samples = 1ULL << 63; }, {}, "9223372036854775808"},
        Lie{"pages_expected_1e7", [](auto& r) { r.pages_expected = 10'000'000; }, {}, "10000000 pages expected"},
        Lie{"no_pages_expected", [](auto& r) { r.pages_expected = 0; }, {}, "0 pages expected"},
        Lie{"pages_written_1e6",
            [](auto& r) {
              r.pages_written = 1'000'000;
              r.samples = 145'000'000;
            },
            {},
            "1000000 pages written"},
        Lie{"first_page", [](auto& r) { r.first_page = r.pages_written; }, {}, "page 0 is lost"}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST_F(HostileInsTest, AForgedStatusFrameAsksForNothing) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  for (int k = 0; k < 20; ++k) {
    timers_.run_until([] { return false; }, 1s);
    ins_.on_status({.state = ins::State::rotating, .pages_written = 65535});
  }
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(ins_.pages_read.size(), FakeIns::pages);
}

// The rotation takes 100 s; the frames go on for as long as the run may wait. It ends when the INS answers that it is over:
// the next question comes within a second.
TEST_F(HostileInsTest, ForgedStatusFramesDoNotProlongTheRotation) {
  begin();
  ASSERT_TRUE(until(State::rotating));
  const SteadyTime began = timers_.now();
  ins::Status rotating;
  rotating.state = ins::State::rotating;
  forge_status(rotating);
  ASSERT_TRUE(until(State::draining));
  EXPECT_LT(seconds(began), FakeIns::rotation_s + 2.0);
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST_F(HostileInsTest, BusyRepeatRequestIsRepeatedAndNotForEver) {
  int busy = 3;
  ins_.alter = [&](Request request, Answer<Bytes>& answer) {
    if (begins(request, {0x27, 0x01}) && busy-- > 0) {
      answer = tl::unexpected(PortError{PortError::Kind::negative, 0x21, "fake0: busyRepeatRequest (0x21)"});
    }
  };
  begin();
  EXPECT_EQ(end(), State::completed) << reason();

  observer_.finished = 0;
  busy = 1'000'000;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("busyRepeatRequest (0x21)"));
}

TEST_F(HostileInsTest, OneByteABlockIsRefused) {
  ins_.block_bytes = 1;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("TransferData: a block of 1 bytes"));
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(HostileInsTest, SmallBlocksAreTaken) {
  ins_.block_bytes = 126;
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
}

struct Drift {
  const char* name;
  double largest_m;
  double elapsed_s;
  const char* words;
};

class DriftLies : public HostileInsTest, public testing::WithParamInterface<Drift> {};

TEST_P(DriftLies, AreRefusedByNameAndValue) {
  ins_.alter = [&](Request request, Answer<Bytes>& answer) {
    if (answer && begins(request, {0x31, 0x03, 0x03, 0x04})) {
      ins::NavigationCheckRecord record{true, GetParam().elapsed_s, 0, 0, GetParam().largest_m};
      const Bytes bytes = ins::encode(record);
      answer->resize(4);
      answer->insert(answer->end(), bytes.begin(), bytes.end());
    }
  };
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr(GetParam().words));
  EXPECT_NE(ins_.state(), ins::State::checking);
  EXPECT_TRUE(old_set_in_force());
}

INSTANTIATE_TEST_SUITE_P(Run, DriftLies,
                         testing::Values(Drift{"huge", 1e308, 30, "1e+308"}, Drift{"negative", -5.0, 30, "is -5"},
                                         Drift{"beyond_free_fall", 1e6, 30, "1e+06 m away"},
                                         Drift{"too_soon", 50, 3, "done after 3 s, 30 s were asked for"}),
                         [](const auto& tested) { return std::string(tested.param.name); });

// --- who answers, and what it holds -----------------------------------------------------------------------------------

class AnotherOne : public HostileInsTest, public testing::WithParamInterface<State> {};

// The link stays up, and another unit is on the plug when the run comes to write.
TEST_P(AnotherOne, IsNoticedBeforeAnythingIsWritten) {
  config_.drift_check_s = 0.0;
  begin();
  ASSERT_TRUE(until(GetParam()));
  ins_.serial = std::string("OTHER-99");
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("INS OTHER-99 answers, but run 1 belongs to INS FAKE-1"));
  EXPECT_THAT(reason(), HasSubstr(old_set));
  ins_.power_cycle();
  EXPECT_TRUE(old_set_in_force());
}

TEST_P(AnotherOne, IsNoticedByItsPowerCycles) {
  config_.drift_check_s = 0.0;
  alter_state([](ins::StateRecord& record) { record.power_cycles += 40; });
  altering_ = false;
  begin();
  ASSERT_TRUE(until(GetParam()));
  altering_ = true;
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("the power-cycle counter is 41, it was 1"));
  ins_.power_cycle();
  EXPECT_TRUE(old_set_in_force());
}

// Its power failed while nothing was asked: locked again, with all that the run found in it before.
TEST_P(AnotherOne, IsNotWhatRestartedOnce) {
  config_.drift_check_s = 0.0;
  begin();
  ASSERT_TRUE(until(GetParam()));
  ins_.power_cycle();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_FALSE(old_set_in_force());
  EXPECT_THAT(observer_.warnings, testing::Contains(HasSubstr("the INS restarted before")));
}

TEST_P(AnotherOne, IsNoticedByItsSetInForceAfterARestart) {
  config_.drift_check_s = 0.0;
  begin();
  ASSERT_TRUE(until(GetParam()));
  ins_.power_cycle();
  ins_.alter = [](Request request, Answer<Bytes>& answer) {
    if (answer && begins(request, read_of(ins::did::coefficients_in_force))) {
      auto set = *ins::decode_coefficients(Request(*answer).subspan(3));
      set.value[0] += 1e-6;
      answer = uds::read_response(ins::did::coefficients_in_force, ins::encode(set));
    }
  };
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("its set in force is not the one that was read before"));
  ins_.power_cycle();
  EXPECT_TRUE(old_set_in_force());
}

TEST_P(AnotherOne, IsNoticedByItsRotationAfterARestart) {
  config_.drift_check_s = 0.0;
  alter_state([](ins::StateRecord& record) { record.run_id += 3; });
  altering_ = false;
  begin();
  ASSERT_TRUE(until(GetParam()));
  altering_ = true;
  ins_.power_cycle();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("its FLASH holds rotation"));
  ins_.power_cycle();
  EXPECT_TRUE(old_set_in_force());
}

// Each time that it is asked, one more.
TEST_F(HostileInsTest, AnInsThatRestartsForEverEndsTheRun) {
  config_.drift_check_s = 0.0;
  begin();
  ASSERT_TRUE(until(State::erasing));
  std::uint32_t restarts = 0;
  ins_.alter = [&](Request request, Answer<Bytes>& answer) {
    if (answer && begins(request, read_of(ins::did::state))) {
      auto state = *ins::decode_state(Request(*answer).subspan(3));
      state.power_cycles += ++restarts;
      answer = uds::read_response(ins::did::state, ins::encode(state));
    }
  };
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("restart number 6 of this run"));
  ins_.power_cycle();
  EXPECT_TRUE(old_set_in_force());
}

INSTANTIATE_TEST_SUITE_P(Run, AnotherOne, testing::Values(State::erasing, State::writing, State::committing),
                         [](const auto& tested) { return std::string(name(tested.param)); });

TEST_F(HostileInsTest, AnEraseThatWasNotDoneIsNoticedBeforeTheWrite) {
  ins_.erases = false;
  bool written = false;
  ins_.alter = [&](Request request, Answer<Bytes>&) { written = written || begins(request, {0x2E, 0x02, 0x11}); };
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("to be erased and still holds version 0"));
  EXPECT_FALSE(written);
}

class ImpossibleSet : public HostileInsTest {
 protected:
  ImpossibleSet() {
    ins_.alter = [](Request request, Answer<Bytes>& answer) {
      if (answer && begins(request, read_of(ins::did::coefficients_in_force))) {
        auto set = *ins::decode_coefficients(Request(*answer).subspan(3));
        if (set.version == 0) {
          set.value[4] = 1e300;
          const auto bytes = ins::encode(set);
          answer = uds::read_response(ins::did::coefficients_in_force, bytes);
        }
      }
    };
  }
};

TEST_F(ImpossibleSet, IsNotMergedIntoTheNewOne) {
  estimators_.answer->result.determined[4] = false;
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("gyro_drift_y = "));
  EXPECT_THAT(reason(), HasSubstr("physically possible"));
  EXPECT_TRUE(old_set_in_force());
}

TEST_F(ImpossibleSet, IsWarnedOfAndReplacedWhereEveryValueIsNew) {
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  ASSERT_FALSE(observer_.warnings.empty());
  EXPECT_THAT(observer_.warnings[0], HasSubstr("gyro_drift_y = "));
  EXPECT_EQ(ins_.in_force().value[4], new_value);
}

// --- budgets as such ------------------------------------------------------------------------------------------------

TEST(StateBudget, EveryStateThatIsNotAnEndHasOneAndItBearsWithALostLink) {
  InsConfig config;
  for (const Transition& row : transition_table()) {
    EXPECT_GT(budget_s(row.state, config, 1.0), 0.0) << name(row.state);
    if (row.event == Event::link_lost) {
      EXPECT_GT(budget_s(row.state, config, 1.0), config.lost_after_s + config.request_timeout_s) << name(row.state);
    }
  }
}

TEST(StateBudget, IsAsLongAsTheProfileSaysThatTheInsMayTake) {
  InsConfig quick, slow;
  slow.time_scale = quick.time_scale = 2.0;
  auto profile = std::make_shared<profile::Profile>(*quick.profile);
  profile->timing.erase_s += 100.0;
  profile->timing.write_s += 200.0;
  profile->timing.commit_s += 300.0;
  profile->timing.restart_s += 400.0;
  profile->timing.stop_s += 50.0;
  slow.profile = profile;
  const auto longer = [&](State state) { return budget_s(state, slow, 1.0) - budget_s(state, quick, 1.0); };
  EXPECT_DOUBLE_EQ(longer(State::erasing), 100.0);
  EXPECT_DOUBLE_EQ(longer(State::writing), 200.0);
  EXPECT_DOUBLE_EQ(longer(State::committing), 300.0);
  EXPECT_DOUBLE_EQ(longer(State::resetting), 400.0 / 2.0 + 200.0);  // on the INS's clock, and what it writes meanwhile
  EXPECT_DOUBLE_EQ(longer(State::stopping), 50.0 / 2.0);
  EXPECT_DOUBLE_EQ(longer(State::verifying), 0.0);
}

// The INS's clock may run faster (virtual INS): what is waited for on it is shorter, what the bus takes is not.
TEST(StateBudget, FollowsTheClockOfTheIns) {
  InsConfig config;
  const double at_once = budget_s(State::checking_old, config, 1.0);
  config.time_scale = 10.0;
  EXPECT_NEAR(at_once - budget_s(State::checking_old, config, 1.0), 0.9 * (config.drift_check_s + 60.0), 1e-9);
}

}  // namespace
}  // namespace selfcal
