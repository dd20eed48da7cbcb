#include "daemon/store/run_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <fstream>

#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

using testing::HasSubstr;

class RunStoreTest : public testing::Test {
 protected:
  std::unique_ptr<RunStore> open() {
    auto store = RunStore::open(file_);
    EXPECT_TRUE(store) << store.error().message;
    return std::move(*store);
  }

  static RunRecord begun() {
    RunRecord run;
    run.ins = std::string("bench");
    run.user = std::string("ann");
    run.schedule = "horizontal";
    run.started_utc = "2026-01-01T00:00:00Z";
    run.software = std::string("0.1");
    return run;
  }

  // By SQL, as another program would.
  void change(const char* sql) {
    sqlite3* raw = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &raw), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(raw, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(raw);
    sqlite3_close(raw);
  }

  // "sequence:run " of each entry.
  std::string outbox() {
    sqlite3* raw = nullptr;
    EXPECT_EQ(sqlite3_open(file_.c_str(), &raw), SQLITE_OK);
    std::string text;
    sqlite3_exec(
        raw, "SELECT sequence || ':' || run || ' ' FROM outbox ORDER BY sequence",
        [](void* to, int, char** column, char**) {
          *static_cast<std::string*>(to) += column[0];
          return 0;
        },
        &text, nullptr);
    sqlite3_close(raw);
    return text;
  }

  const testing_support::ScratchFolder scratch_;
  const std::filesystem::path& folder_ = scratch_.path();
  const std::filesystem::path file_ = folder_ / "selfcal.db";
};

TEST_F(RunStoreTest, ARunIsFoundAgainAfterReopening) {
  RunRecord run = begun();
  {
    auto store = open();
    run.id = *store->create_run(run);
    run.state = State::rotating;
    run.serial = std::string("SN'1");  // a quote, so that binding is seen to work
    run.rotation = 4000000000u;
    ASSERT_TRUE(store->update_run(run));
    ASSERT_TRUE(store->add_event(run.id, {"2026-01-01T00:00:01Z", "state", "rotating"}));
  }
  auto store = open();
  const auto unfinished = *store->unfinished_runs();
  ASSERT_EQ(unfinished.size(), 1u);
  EXPECT_EQ(unfinished[0].serial, "SN'1");
  EXPECT_EQ(unfinished[0].state, State::rotating);
  EXPECT_EQ(unfinished[0].rotation, 4000000000u);
  EXPECT_EQ(store->events(run.id)->at(0).text, "rotating");

  run.state = State::completed;
  ASSERT_TRUE(store->update_run(run));
  EXPECT_TRUE(store->unfinished_runs()->empty());
  EXPECT_EQ(store->runs_of_serial("SN'1")->size(), 1u);
  EXPECT_EQ(store->runs_of_serial("other")->size(), 0u);
  EXPECT_EQ(store->runs_of_serial("")->size(), 1u);
}

// A database of the first release: what it holds stays, and what it cannot know has the value of its time.
TEST_F(RunStoreTest, AnOlderDatabaseIsTakenOver) {
  RunRecord run = begun();
  {
    auto store = open();
    run.id = *store->create_run(run);
  }
  change(
      "DROP TRIGGER run_ended; DROP TABLE outbox; DROP TABLE hub_past_parameters; DROP TABLE hub_past; "
      "ALTER TABLE runs DROP COLUMN stop_when_met; ALTER TABLE runs DROP COLUMN early_end_s; "
      "ALTER TABLE runs DROP COLUMN amends; ALTER TABLE runs DROP COLUMN amends_with; ALTER TABLE runs DROP COLUMN "
      "source; "
      "PRAGMA user_version=1");
  auto store = open();
  const auto found = *store->run(run.id);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->user, "ann");
  EXPECT_FALSE(found->stop_when_met);
  EXPECT_EQ(found->early_end_s, -1.0);
  EXPECT_EQ(found->amends, 0);
  EXPECT_TRUE(found->amends_with.empty());
  run.stop_when_met = true;
  EXPECT_TRUE(store->run(*store->create_run(run)).value()->stop_when_met);
}

// For the hub: each run once, in the transaction that ends it, also where it ended before there was an outbox.
TEST_F(RunStoreTest, ARunThatEndsStandsInTheOutboxOnce) {
  auto store = open();
  RunRecord first = begun(), second = begun();
  first.id = *store->create_run(first);
  second.id = *store->create_run(second);
  EXPECT_EQ(outbox(), "");
  second.state = State::failed;
  ASSERT_TRUE(store->update_run(second));
  second.recording = "pruned later";
  ASSERT_TRUE(store->update_run(second));
  first.state = State::completed;
  ASSERT_TRUE(store->update_run(first));
  EXPECT_EQ(outbox(), "1:2 2:1 ");
  store.reset();
  change(
      "DROP TABLE outbox; DROP TABLE hub_past; DROP TABLE hub_past_parameters; DROP TRIGGER run_ended; "
      "ALTER TABLE runs DROP COLUMN source; PRAGMA user_version=4");
  store = open();
  EXPECT_EQ(outbox(), "1:1 2:2 ");
}

// What other sets measured of a unit belongs to its past, by time, and is no run of ours.
TEST_F(RunStoreTest, HistoryHoldsWhatOtherSetsMeasured) {
  auto store = open();
  RunRecord run = begun();
  run.serial = "S";
  run.id = *store->create_run(run);
  RunStore::Parameters parameters;
  parameters.value.fill(2.0);
  ASSERT_TRUE(store->store_parameters(run.id, parameters));
  run.state = State::completed;
  run.ended_utc = "2026-03-01T00:00:00Z";
  ASSERT_TRUE(store->update_run(run));
  change(
      "INSERT INTO hub_past VALUES(7,'set_b',1,'S','2026-02-01T00:00:00Z'),(9,'set_c',4,'S','2026-04-01T00:00:00Z'),"
      "(8,'set_c',3,'T','2026-02-01T00:00:00Z');"
      "INSERT INTO hub_past_parameters VALUES(7,'accel_bias_x',1.0,0.5,1),(9,'accel_bias_x',3.0,0.5,1),"
      "(8,'accel_bias_x',9.0,0.5,1),(7,'accel_bias_y',9.0,0.5,1)");
  const auto history = *store->parameter_history("S", 0);
  ASSERT_EQ(history.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(history[i].value, static_cast<double>(i + 1));
    EXPECT_EQ(history[i].run, i == 1 ? run.id : 0);
  }
}

TEST_F(RunStoreTest, NumbersAreNeverUsedTwice) {
  auto store = open();
  EXPECT_EQ(*store->create_run(begun()), 1);
  EXPECT_EQ(*store->create_run(begun()), 2);
}

TEST_F(RunStoreTest, HistoryHoldsCompletedRunsThatWrote) {
  auto store = open();
  const std::string serial("S");
  RunStore::Parameters parameters;
  parameters.value.fill(3.5);
  parameters.sigma.fill(0.5);
  parameters.determined.fill(true);
  for (const auto& [state, dry] :
       {std::pair{State::completed, false}, {State::refused, false}, {State::completed, true}}) {
    RunRecord run = begun();
    run.dry_run = dry;
    run.id = *store->create_run(run);
    run.serial = serial;
    run.state = state;
    ASSERT_TRUE(store->update_run(run));
    ASSERT_TRUE(store->store_parameters(run.id, parameters));
  }
  const auto history = *store->parameter_history("S", 7);
  ASSERT_EQ(history.size(), 1u);
  EXPECT_EQ(history[0].value, 3.5);
  EXPECT_EQ(history[0].sigma, 0.5);
}

TEST_F(RunStoreTest, SetsAreKeptByRole) {
  auto store = open();
  const RunId run = *store->create_run(begun());
  ASSERT_TRUE(store->store_set(run, SetRole::previous, {1, 0, 2}));
  EXPECT_EQ(**store->set(run, SetRole::previous), (std::vector<std::uint8_t>{1, 0, 2}));
  EXPECT_FALSE(*store->set(run, SetRole::written));
}

// SQLite's own words are the same for every cause; the system's tell the operator which one it is.
TEST_F(RunStoreTest, AFileThatCannotBeOpenedIsNamedWithTheCause) {
  const auto absent = RunStore::open(folder_ / "no-such-folder" / "selfcal.db");
  ASSERT_FALSE(absent);
  EXPECT_THAT(absent.error().message, HasSubstr("no-such-folder/selfcal.db"));
  EXPECT_THAT(absent.error().message, HasSubstr("No such file or directory"));
  // A file where a folder should be, because permissions do not stop a test that runs as root.
  std::ofstream(folder_ / "state") << "x";
  const auto below_a_file = RunStore::open(folder_ / "state" / "selfcal.db");
  ASSERT_FALSE(below_a_file);
  EXPECT_THAT(below_a_file.error().message, HasSubstr("Not a directory"));
}

TEST_F(RunStoreTest, ADamagedDatabaseIsRefusedAndABackupTakesItsPlace) {
  {
    auto store = open();
    for (int i = 0; i < 200; ++i) {
      ASSERT_TRUE(store->create_run(begun()));
    }
    ASSERT_TRUE(RunStore::copy(file_, folder_ / "backup.db"));
  }
  {
    std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(3 * 4096);  // a page of the runs table (SQLite's default page size)
    const std::string rubbish(4096, '\x5a');
    file.write(rubbish.data(), 4096);
  }
  const auto damaged = RunStore::open(file_);
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().kind, ErrorKind::device);
  EXPECT_THAT(damaged.error().message, HasSubstr(file_.string()));
  EXPECT_FALSE(RunStore::check(file_));
  EXPECT_TRUE(RunStore::check(folder_ / "backup.db"));
  std::filesystem::rename(folder_ / "backup.db", file_);
  EXPECT_EQ(open()->runs_of_serial("")->size(), 200u);
}

TEST_F(RunStoreTest, AFileThatIsNoDatabaseIsRefused) {
  std::ofstream(file_) << std::string(8192, 'x');
  const auto store = RunStore::open(file_);
  ASSERT_FALSE(store);
  EXPECT_THAT(store.error().message, HasSubstr("not a database"));
}

}  // namespace
}  // namespace selfcal
