// Whole calibrations of a fake INS that takes no schedule, in simulated time: the port commands its moves, and whatever goes wrong in
// one ends the run with a line that names position and value, the INS at rest.
#include <fstream>
#include <sstream>

#include "daemon/ins/move_port.hpp"
#include "protocol/byte_order.hpp"
#include "protocol/flash/page.hpp"
#include "protocol/profile/read_profile.hpp"
#include "tests/own_ins/identifiers.hpp"
#include "tests/unit/daemon/calibration_run_fixture.hpp"

namespace selfcal {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing_support::CalibrationRunTest;
using testing_support::FakeIns;

constexpr std::uint16_t move_did = 0x0230;
constexpr std::string_view by_angle = "there = \"angle\"\ntolerance_deg = 1.0\n", by_state = "there = \"state\"\n";

void replace(std::string& text, std::string_view from, std::string_view to, std::string_view with) {
  const auto begin = text.find(from), end = text.find(to, begin);
  ASSERT_NE(end, std::string::npos) << from;
  text.replace(begin, end - begin, with);
}

// Our own INS's, with moves: the state has one byte and two floats more.
profile::ProfilePtr moving(std::string_view there, std::string_view type = "i32") {
  std::ifstream in(SELFCAL_SOURCE_DIR "/config/profiles/selfcal.toml");
  std::stringstream content;
  content << in.rdbuf();
  std::string text = content.str();
  replace(text, "bytes = 19\n", "fields.state", "bytes = 28\n");
  replace(text, "[schedule]", "[site]",
          fmt::format("fields.gimbal_moving = {{ at = 19, type = \"u8\" }}\n"
                      "fields.outer = {{ at = 20, type = \"f32\", unit = \"deg\" }}\n"
                      "fields.inner = {{ at = 24, type = \"f32\", unit = \"deg\" }}\n\n"
                      "[move]\ndid = 0x0230\nbytes = 8\nlongest_s = 15\n{}"
                      "fields.outer = {{ at = 0, type = \"{}\", unit = \"mdeg\" }}\n"
                      "fields.inner = {{ at = 4, type = \"{}\", unit = \"mdeg\" }}\n\n",
                      there, type, type));
  auto profile = profile::parse_profile(text, "moving.toml");
  return profile ? *profile : throw std::runtime_error(profile.error().message);
}

// Three seconds from one position to the next.
class Gimbal {
 public:
  explicit Gimbal(Timers& timers) : timers_(timers) {}
  void turn_to(std::array<double, 2> target) {
    from_ = angles();
    to_ = sticks ? from_ : target;
    begun_ = timers_.now();
  }
  void stop() { from_ = to_ = angles(); }
  bool moving() const { return from_ != to_ && progress() < 1.0; }
  std::array<double, 2> angles() const {
    const double u = progress();
    return {from_[0] + u * (to_[0] - from_[0]), from_[1] + u * (to_[1] - from_[1])};
  }
  bool sticks = false;

 private:
  double progress() const { return std::min(1.0, std::chrono::duration<double>(timers_.now() - begun_).count() / 3.0); }
  Timers& timers_;
  std::array<double, 2> from_{40.0, 0.0}, to_ = from_;
  SteadyTime begun_{0};
};

class MovePortTest : public CalibrationRunTest {
 protected:
  MovePortTest() {
    speak(by_angle);
    schedule_ = {{{0, 0}, {90, 0}, {90, -45}, {0, -45}}, {20, 20, 20, 20}, 5.0};
    ins_.alter = [this](std::span<const std::uint8_t> request, Answer<Bytes>& answer) { between(request, answer); };
  }
  ~MovePortTest() override { run_.reset(); }  // before its port

  void speak(std::string_view there, std::string_view type = "i32") {
    config_.profile = moving(there, type);
    config_.status_id.reset();
  }
  InsPort& port() override {
    port_.reset();
    port_ = std::make_unique<MovePort>(timers_, std::shared_ptr<InsPort>(std::shared_ptr<InsPort>(), &ins_), config_);
    return *port_;
  }

  void between(std::span<const std::uint8_t> request, Answer<Bytes>& answer) {
    const auto number = static_cast<std::uint16_t>(request.size() >= 3 ? request[1] << 8U | request[2] : 0);
    if (request[0] == uds::service::read_data && number == ins::did::state && answer) {
      Bytes more(9);
      ByteWriter out(more);
      out.put(static_cast<std::uint8_t>(gimbal_.moving()));
      for (const double angle : gimbal_.angles()) {
        out.put(std::bit_cast<std::uint32_t>(static_cast<float>(angle)));
      }
      answer->insert(answer->end(), more.begin(), more.end());
    } else if (request[0] == uds::service::write_data && number == move_did && answer) {
      if (on_move) {
        on_move(moves_.size() + 1, answer);
      }
      if (answer) {
        take_move(request.subspan(3));
      }
    } else if (request[0] == uds::service::routine_control && request[1] == 2 && answer) {
      gimbal_.stop();
    }
  }
  void take_move(std::span<const std::uint8_t> record) {
    ByteReader in(record);
    const auto outer = static_cast<std::int32_t>(in.get<std::uint32_t>());
    const auto inner = static_cast<std::int32_t>(in.get<std::uint32_t>());
    moves_.push_back({outer / 1000, inner / 1000, ins_.starts});
    gimbal_.turn_to({outer / 1000.0, inner / 1000.0});
  }
  static tl::unexpected<PortError> no(std::uint8_t nrc) {
    return tl::unexpected(PortError{PortError::Kind::negative, nrc, "fake0: INS refused: " + uds::describe_nrc(nrc)});
  }
  bool until_moves(std::size_t count) {
    return timers_.run_until([&] { return moves_.size() >= count; }, 1000s);
  }
  void fails(const std::string& words, int stops) {
    EXPECT_EQ(end(), State::failed);
    EXPECT_THAT(reason(), HasSubstr(words));
    EXPECT_EQ(ins_.stops, stops);
    EXPECT_NE(ins_.state(), ins::State::rotating);
    EXPECT_FALSE(gimbal_.moving());
    EXPECT_TRUE(old_set_in_force());
  }

  struct Move {
    int outer_deg, inner_deg, starts;  // of the recording, before it
    bool operator==(const Move&) const = default;
  };
  Gimbal gimbal_{timers_};
  std::vector<Move> moves_;
  std::function<void(std::size_t number, Answer<Bytes>& answer)> on_move;
  std::unique_ptr<MovePort> port_;
};

TEST_F(MovePortTest, TheScheduleIsTurnedMoveByMove) {
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_THAT(moves_, ElementsAre(Move{0, 0, 0}, Move{90, 0, 1}, Move{90, -45, 1}, Move{0, -45, 1}));
  EXPECT_EQ(ins_.starts, 1);
  EXPECT_EQ(ins_.stops, 1);
  // 80 s of dwells and three moves of 3 s, each seen within some tenths, at 5 s a page; the last one is not whole.
  EXPECT_THAT(ins_.pages_read.size(), testing::AllOf(testing::Ge(17U), testing::Le(18U)));
  EXPECT_EQ(ins_.in_force().version, 1U);
}

// The INS's clock runs four times faster here, so that 90 s of data, the least for an estimate, are there in the second dwell.
class EarlyEndOfMovesTest : public MovePortTest {
 protected:
  static constexpr double time_scale = 4.0;
  EarlyEndOfMovesTest() {
    config_.time_scale = time_scale;
    config_.drift_check_s = 0.0;  // the fake's check knows no other clock
    config_.running_estimate_s = 20.0;
    ins_.sample_rate_hz = FakeIns::pages * flash::samples_per_page / (FakeIns::rotation_s * time_scale);
    schedule_.dwell_s.assign(4, 20.0 * time_scale);
    estimators_.met_from = 2;
  }
  void begin_wanting_it() {
    RunRecord record;
    record.stop_when_met = true;
    begin(record);
  }
};

TEST_F(EarlyEndOfMovesTest, TheRotationEndsInADwellWhenTheTolerancesAreMet) {
  for (const auto there : {by_angle, by_state}) {
    speak(there);
    moves_.clear();
    estimators_.running_jobs = observer_.finished = ins_.stops = 0;
    ins_.pages_read.clear();
    begin_wanting_it();
    EXPECT_EQ(end(), State::completed) << reason();
    EXPECT_EQ(moves_.size(), 2U);
    EXPECT_EQ(ins_.stops, 1);
    EXPECT_FALSE(gimbal_.moving());
    // Into the second dwell: 80 s, a move of 12 s, and less than 80 s more.
    EXPECT_THAT(run_->record().early_end_s, testing::AllOf(testing::Gt(92.0), testing::Lt(172.0)));
    EXPECT_EQ(ins_.pages_read.size(), ins_.pages_written());
  }
}

// The first estimate is begun at 100 s, with five pages, and comes 4 s later, amid the move that begins at 96 s and has 15 s.
TEST_F(EarlyEndOfMovesTest, NotWhileAMoveIsUnderWay) {
  estimators_.met_from = 1;
  schedule_.dwell_s[0] = 96.0;
  begin_wanting_it();
  on_move = [this](std::size_t number, Answer<Bytes>&) { gimbal_.sticks = number == 2; };
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("position 2 is not reached within 15 s"));
  EXPECT_GE(estimators_.running_jobs, 1);
  EXPECT_LT(run_->record().early_end_s, 0.0);
}

TEST_F(MovePortTest, AMoveMayBeOverByState) {
  speak(by_state);
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(moves_.size(), 4U);
  EXPECT_EQ(ins_.stops, 1);
}

TEST_F(MovePortTest, AMoveThatIsRefusedEndsTheRun) {
  on_move = [](std::size_t number, Answer<Bytes>& answer) {
    if (number == 3) {
      answer = no(0x22);
    }
  };
  begin();
  fails(
      "fake0: the rotation is broken off at position 3: the move to 90.000 and -45.000 deg is not taken: INS "
      "refused: "
      "conditionsNotCorrect (0x22)",
      1);
}

TEST_F(MovePortTest, AFirstMoveThatIsRefusedEndsTheRunBeforeAnythingIsRecorded) {
  on_move = [](std::size_t, Answer<Bytes>& answer) { answer = no(0x31); };
  begin();
  fails("position 1: the move to 0.000 and 0.000 deg is not taken", 0);
  EXPECT_EQ(ins_.starts, 0);
}

TEST_F(MovePortTest, AnInsThatIsBusyIsAskedAgain) {
  int busy = 0;
  on_move = [&](std::size_t number, Answer<Bytes>& answer) {
    if (number == 2 && ++busy <= 3) {
      answer = no(0x21);
    }
  };
  begin();
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(busy, 4);
}

TEST_F(MovePortTest, APositionThatIsNotReachedIsTold) {
  on_move = [this](std::size_t number, Answer<Bytes>&) { gimbal_.sticks = number == 3; };
  begin();
  fails("position 3 is not reached within 15 s: the gimbal is at 90.00 and 0.00 deg", 1);
}

TEST_F(MovePortTest, AFirstPositionThatIsNotReachedIsTold) {
  gimbal_.sticks = true;
  begin();
  fails("position 1 is not reached within 15 s: the gimbal is at 40.00 and 0.00 deg", 0);
}

TEST_F(MovePortTest, APositionThatIsLeftIsTold) {
  for (const auto there : {by_angle, by_state}) {
    speak(there);
    moves_.clear();
    observer_.finished = 0;
    ins_.stops = 0;
    begin();
    ASSERT_TRUE(until_moves(2));
    // By angle that is seen at the end of the dwell, by state at the next look.
    timers_.after(there == by_angle ? 21s : 10s, [this] { gimbal_.turn_to({70.0, 0.0}); });
    fails("position 2 is left before its time: the gimbal ", 1);
  }
}

TEST_F(MovePortTest, AnInsThatEndsItsRecordingItselfIsTold) {
  begin();
  ASSERT_TRUE(until_moves(3));
  ins_.gimbal_sticks = true;  // it fails after half of its time
  fails("position 3: the INS says that it failed", 0);
}

TEST_F(MovePortTest, AnAbortInAMoveStopsTheGimbal) {
  begin();
  ASSERT_TRUE(until_moves(3));
  run_->abort("test");
  const SteadyTime asked = timers_.now();
  EXPECT_EQ(end(), State::aborted);
  EXPECT_LT(timers_.now() - asked, 10s);
  EXPECT_EQ(ins_.stops, 1);
  EXPECT_FALSE(gimbal_.moving());
  EXPECT_EQ(moves_.size(), 3U);
}

TEST_F(MovePortTest, AnAbortOnTheWayToTheFirstPositionIsWaitedFor) {
  begin();
  ASSERT_TRUE(until_moves(1));
  run_->abort("test");
  EXPECT_EQ(end(), State::aborted);
  EXPECT_EQ(ins_.starts, 0);
  EXPECT_FALSE(gimbal_.moving());
}

TEST_F(MovePortTest, ARestartOfTheServiceLosesTheRotationSaysSoAndStopsIt) {
  begin();
  ASSERT_TRUE(until_moves(3));
  restart_daemon();
  fails("the rotation is lost: the INS is aborted when it answers again", 1);
}

TEST_F(MovePortTest, ARestartOfTheServiceBehindTheLastDwellLosesNothing) {
  begin();
  ASSERT_TRUE(until(State::draining));
  restart_daemon();
  EXPECT_EQ(end(), State::completed) << reason();
}

TEST_F(MovePortTest, ALinkThatIsLostInADwellIsSurvived) {
  begin();
  ASSERT_TRUE(until_moves(2));
  timers_.after(8s, [this] { ins_.dead = true; });
  timers_.after(12s, [this] { ins_.dead = false; });
  EXPECT_EQ(end(), State::completed) << reason();
  EXPECT_EQ(moves_.size(), 4U);
}

TEST_F(MovePortTest, AnInsThatAnswersNothingInAMoveEndsTheRun) {
  begin();
  ASSERT_TRUE(until_moves(2));
  ins_.dead = true;
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("link lost for more than 20 s"));
}

TEST_F(MovePortTest, AnInsThatAnswersNothingOnTheWayToTheFirstPositionEndsTheRun) {
  begin();
  ASSERT_TRUE(until_moves(1));
  ins_.dead = true;
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("link lost for more than 20 s"));
}

TEST_F(MovePortTest, AScheduleThatTheRecordOfAMoveCannotHoldTurnsNothing) {
  speak(by_angle, "i16");  // 32,767 mdeg at most
  begin();
  EXPECT_EQ(end(), State::failed);
  EXPECT_THAT(reason(), HasSubstr("position 2 of the schedule: "));
  EXPECT_TRUE(moves_.empty());
}

}  // namespace
}  // namespace selfcal
