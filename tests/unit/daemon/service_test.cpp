// The service as a whole, on a D-Bus of its own: what a reload, a full disk and a restore do to runs and to operators.
// Its INS does not exist, so that a run stays in its first state.
#include "daemon/service.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>

#include "daemon/store/database_copies.hpp"
#include "protocol/operator_api/names.hpp"
#include "protocol/schedule_file/schedule_file.hpp"
#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

// A dbus-daemon on a socket of its own; it ends with the test.
class PrivateBus {
 public:
  PrivateBus() {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) {
      return;
    }
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      execlp("dbus-daemon", "dbus-daemon", "--session", "--nofork", "--print-address", nullptr);
      _exit(127);
    }
    close(ends[1]);
    char c = 0;
    while (read(ends[0], &c, 1) == 1 && c != '\n') {
      address_ += c;
    }
    close(ends[0]);
  }
  ~PrivateBus() {
    if (pid_ <= 0) {
      return;
    }
    kill(pid_, SIGTERM);
    waitpid(pid_, nullptr, 0);
  }
  PrivateBus(const PrivateBus&) = delete;
  PrivateBus& operator=(const PrivateBus&) = delete;
  const std::string& address() const { return address_; }

 private:
  pid_t pid_ = -1;
  std::string address_;
};

class ServiceTest : public testing::Test {
 protected:
  ServiceTest() {
    std::ofstream(folder_ / "key") << "000102030405060708090a0b0c0d0e0f\n";
    unsetenv(operator_api::bus_variable);
  }

  void configure(const std::string& daemon_keys, const std::string& sections) {
    std::ofstream(folder_ / "selfcald.toml") << "[daemon]\nstate_directory = \"" << (folder_ / "state").string()
                                             << "\"\nbus = \"" << bus_.address() << "\"\nlcm_url = \"\"\n"
                                             << daemon_keys << sections;
  }
  std::string section(const std::string& name, const std::string& keys = "") const {
    return "[ins." + name + "]\ninterface = \"absent-" + name + "\"\nkey_file = \"" + (folder_ / "key").string() +
           "\"\n" + keys;
  }
  void start() {
    const std::string file = folder_ / "selfcald.toml";
    auto config = load_config(file);
    ASSERT_TRUE(config) << config.error().message;
    auto service = Service::create(loop_, std::move(*config), file);
    ASSERT_TRUE(service) << service.error().message;
    service_ = std::move(*service);
  }
  Operations& operations() { return *service_; }
  Granted<RunId> run(const std::string& ins) {
    StartRequest request;
    request.ins = ins;
    request.user = "ann";
    return operations().start(request);
  }

  PrivateBus bus_;
  const testing_support::ScratchFolder scratch_;
  const fs::path& folder_ = scratch_.path();
  EventLoop loop_;
  std::unique_ptr<Service> service_;
};

TEST_F(ServiceTest, AReloadTakesUpTheNewAndLeavesRunsAlone) {
  configure("", section("a") + section("b"));
  start();
  const auto first = run("a");
  ASSERT_TRUE(first) << first.error().message;
  // a is gone from the file, b has another schedule, c is new.
  configure("", section("b", "schedule = \"table2\"\n") + section("c"));
  service_->reload();
  EXPECT_THAT(operations().instruments(), ElementsAre("a", "b", "c"));
  ASSERT_NE(operations().record("a"), nullptr);
  EXPECT_EQ(operations().record("a")->id, *first);
  EXPECT_FALSE(is_final(operations().record("a")->state));
  const auto second = run("a");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().name, operator_api::error_busy);
  EXPECT_THAT(second.error().message, HasSubstr("busy, run 1 by user ann since"));
  ASSERT_TRUE(run("b"));
  EXPECT_EQ(operations().record("b")->schedule, "table2");
  ASSERT_TRUE(run("c"));
}

TEST_F(ServiceTest, OnlyTheLatestRunThatKeptARecordingIsAmended) {
  configure("", section("a"));
  start();
  const auto unknown = operations().amend({5, {}, false, "", "ann"});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().name, operator_api::error_unknown);
  EXPECT_EQ(unknown.error().message, "no run 5");
  ASSERT_TRUE(run("a"));
  const auto unended = operations().amend({1, {}, false, "", "ann"});
  ASSERT_FALSE(unended);
  EXPECT_THAT(unended.error().message, HasSubstr("run 1 has not ended"));

  service_.reset();
  auto store = *RunStore::open(database_path(folder_ / "state"));
  auto older = **store->run(1);
  older.serial = "S1";
  older.state = State::refused;
  ASSERT_TRUE(store->update_run(older));
  auto later = older;
  later.id = *store->create_run(later);
  later.state = State::completed;
  later.recording = "later.h5";
  ASSERT_TRUE(store->update_run(later));
  store.reset();
  start();
  const auto none = operations().amend({1, {}, false, "", "ann"});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("run 1 has no recording"));

  older.recording = "older.h5";
  ASSERT_TRUE((*RunStore::open(database_path(folder_ / "state")))->update_run(older));
  const auto overtaken = operations().amend({1, {}, false, "", "ann"});
  ASSERT_FALSE(overtaken);
  EXPECT_EQ(overtaken.error().name, operator_api::error_nothing);
  EXPECT_THAT(overtaken.error().message, HasSubstr("run 2 of"));
  EXPECT_THAT(operations().amend({2, {9}, true, "", "ann"}).error().message, HasSubstr("no run 9"));
  EXPECT_THAT(operations().amend({2, {2}, true, "", "ann"}).error().message, HasSubstr("run 2 is given twice"));
  EXPECT_THAT(operations().amend({2, {1, 1}, true, "", "ann"}).error().message, HasSubstr("run 1 is given twice"));
  EXPECT_THAT(operations().amend({2, std::vector<RunId>(8, 1), true, "", "ann"}).error().message,
              HasSubstr("8 further runs, 7 at most"));
  const auto amendment = operations().amend({2, {1}, true, "", "ann"});
  ASSERT_TRUE(amendment) << amendment.error().message;
  EXPECT_EQ(operations().record("a")->amends, 2);
  EXPECT_THAT(operations().record("a")->amends_with, ElementsAre(1));
  EXPECT_THAT((**(*RunStore::open(database_path(folder_ / "state")))->run(3)).amends_with, ElementsAre(1));  // kept
  EXPECT_TRUE(operations().record("a")->dry_run);
}

// The text of a schedule is kept as a file, which a run that is taken up again reads.
TEST_F(ServiceTest, AScheduleGivenAsTextIsCheckedAndKept) {
  configure("", section("a"));
  start();
  StartRequest request;
  request.ins = "a";
  request.user = "ann";
  request.schedule_toml = "positions = [[0, 0], [400, 0]]";
  const auto wrong = operations().start(request);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().name, operator_api::error_unknown);
  EXPECT_THAT(wrong.error().message, HasSubstr("schedule_toml"));
  request.schedule_toml = std::string(100000, ' ');
  EXPECT_THAT(operations().start(request).error().message, HasSubstr("100000 bytes, 65536 at most"));
  request.schedule_toml = "positions = [[0, 0], [90, 0]]\ndwell_s = 50\n";
  const auto begun = operations().start(request);
  ASSERT_TRUE(begun) << begun.error().message;
  const std::filesystem::path kept = operations().record("a")->schedule;
  EXPECT_EQ(kept.parent_path(), folder_ / "state" / "schedules");
  EXPECT_EQ(read_schedule(kept)->dwell_s.front(), 50.0);
}

TEST_F(ServiceTest, AReloadOfAFaultyFileChangesNothing) {
  configure("", section("a"));
  start();
  configure("", section("a", "typo = 1\n") + section("b"));
  service_->reload();
  EXPECT_THAT(operations().instruments(), ElementsAre("a"));
}

TEST_F(ServiceTest, WithTooLittleDiskNoRunBegins) {
  configure("free_space_mib = 1e12\n", section("a"));
  start();
  const auto refused = run("a");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().name, operator_api::error_unavailable);
  EXPECT_THAT(refused.error().message, HasSubstr("MiB free, a run (free_space_mib) needs"));
  EXPECT_FALSE(operations().show(1));  // not even a record of one
}

TEST_F(ServiceTest, ARestoreWaitsForRunsAndThenBringsBackTheirPast) {
  configure("", section("a"));
  start();
  ASSERT_TRUE(operations().backup_database("before.db"));
  ASSERT_TRUE(run("a"));
  const auto busy = operations().restore_database("before.db");
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error().name, operator_api::error_busy);
  ASSERT_TRUE(operations().abort("a", "test"));
  // An abort is taken up in the next turns of the loop; a hang would be ended by the test's time limit.
  while (!is_final(operations().record("a")->state)) {
    loop_.turn(std::chrono::seconds(1));
  }
  EXPECT_FALSE(operations().restore_database("absent.db"));
  EXPECT_TRUE(operations().show(1));  // the database is as it was
  const auto kept = operations().restore_database("before.db");
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_TRUE(fs::exists(*kept));
  EXPECT_FALSE(operations().show(1));
  EXPECT_EQ(*operations().check_database(), "");
  EXPECT_EQ(*run("a"), 1);  // the daemon goes on with it
}

TEST_F(ServiceTest, WhatIsKnownOfAnInsWithoutAskingIt) {
  configure("", section("a"));
  start();
  const Standing standing = operations().standing("a");
  EXPECT_THAT(standing.bus, HasSubstr("absent-a"));
  EXPECT_EQ(standing.last_calibration, 0);
  EXPECT_EQ(standing.set_version, 0u);
}

// Where the interface is missing nobody is asked: the answer comes at once and says so.
TEST_F(ServiceTest, TheStateOfABusThatIsNotThere) {
  configure("", section("a"));
  start();
  std::vector<std::string> told;
  operations().ask_bus("a", [&](const std::string& words) { told.push_back(words); });
  EXPECT_THAT(told, ElementsAre("absent-a: there is no CAN interface of this name"));
  operations().ask_bus("nobody", [&](const std::string& words) { told.push_back(words); });
  EXPECT_EQ(told.size(), 2u);
}

// The run is not over: the next daemon takes it up.
TEST_F(ServiceTest, AStopLeavesARunResumableAndBeginsNone) {
  configure("", section("a"));
  start();
  ASSERT_TRUE(run("a"));
  bool stopped = false;
  service_->stop([&] { stopped = true; });
  while (!stopped) {
    loop_.turn(std::chrono::seconds(1));
  }
  EXPECT_FALSE(is_final(operations().record("a")->state));
  EXPECT_FALSE(run("a"));
}

TEST_F(ServiceTest, TwoServicesDoNotShareAStateDirectory) {
  configure("", section("a"));
  start();
  const std::string file = folder_ / "selfcald.toml";
  const auto second = Service::create(loop_, *load_config(file), file);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("in use by another"));
}

}  // namespace
}  // namespace selfcal
