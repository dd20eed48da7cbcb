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
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(file_.c_str(), &raw), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(
                raw,
                "ALTER TABLE runs DROP COLUMN stop_when_met; ALTER TABLE runs DROP COLUMN early_end_s; "
                "ALTER TABLE runs DROP COLUMN amends; ALTER TABLE runs DROP COLUMN amends_with; PRAGMA user_version=1",
                nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(raw);
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
