// Backups and the way back, and who may work on a state directory.
#include "daemon/store/database_copies.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <fstream>

#include "daemon/host/state_lock.hpp"
#include "daemon/store/run_store.hpp"
#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class DatabaseCopiesTest : public testing::Test {
 protected:
  void add_runs(int count) {
    const auto store = RunStore::open(database_path(folder_));
    ASSERT_TRUE(store);
    for (int i = 0; i < count; ++i) {
      ASSERT_TRUE((*store)->create_run({}));
    }
  }
  std::size_t runs(const fs::path& database) { return (*RunStore::open(database))->runs_of_serial("")->size(); }

  const testing_support::ScratchFolder scratch_;
  const fs::path& folder_ = scratch_.path();
};

TEST_F(DatabaseCopiesTest, ABackupComesBackAndTheFormerDatabaseStays) {
  add_runs(3);
  ASSERT_TRUE(back_up_database(folder_, "monday.db"));
  add_runs(2);
  const auto kept = restore_database(folder_, "monday.db");
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(runs(database_path(folder_)), 3u);
  EXPECT_EQ(runs(*kept), 5u);
  EXPECT_EQ(runs(folder_ / "backups" / "monday.db"), 3u);  // and can be used again
}

TEST_F(DatabaseCopiesTest, AWriteAheadLogLeftByACrashIsNotPlayedIntoTheBackup) {
  add_runs(1);
  ASSERT_TRUE(back_up_database(folder_, "a.db"));
  // A process that dies leaves its log: copied aside while open, put back after.
  {
    const auto store = RunStore::open(database_path(folder_));
    for (int i = 0; i < 50; ++i) {
      ASSERT_TRUE((*store)->create_run({}));
    }
    for (const char* suffix : {"", "-wal"}) {
      fs::copy_file(database_path(folder_).string() + suffix, folder_.string() + "/crashed" + suffix);
    }
  }
  for (const char* suffix : {"", "-wal"}) {
    fs::rename(folder_.string() + "/crashed" + suffix, database_path(folder_).string() + suffix);
  }
  const auto kept = restore_database(folder_, "a.db");
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(runs(database_path(folder_)), 1u);
  EXPECT_EQ(runs(*kept), 51u);  // nothing of the former one is lost either
}

TEST_F(DatabaseCopiesTest, ADamagedDatabaseIsReplaced) {
  add_runs(300);
  ASSERT_TRUE(back_up_database(folder_, "a.db"));
  std::ofstream(database_path(folder_)) << std::string(100000, 'x');
  ASSERT_FALSE(RunStore::open(database_path(folder_)));
  ASSERT_TRUE(restore_database(folder_, "a.db"));
  EXPECT_EQ(runs(database_path(folder_)), 300u);
}

TEST_F(DatabaseCopiesTest, AMissingDatabaseIsRestoredToo) {
  add_runs(4);
  ASSERT_TRUE(back_up_database(folder_, "a.db"));
  fs::remove(database_path(folder_));
  const auto kept = restore_database(folder_, "a.db");
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(*kept, fs::path());
  EXPECT_EQ(runs(database_path(folder_)), 4u);
}

TEST_F(DatabaseCopiesTest, WhatIsNoSoundBackupTouchesNothing) {
  add_runs(3);
  ASSERT_TRUE(back_up_database(folder_, "newer.db"));
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "backups" / "newer.db").c_str(), &raw), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(raw, "PRAGMA user_version=999", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(raw);
  std::ofstream(folder_ / "backups" / "rubbish.db") << std::string(100000, 'x');
  EXPECT_FALSE(restore_database(folder_, "rubbish.db"));
  EXPECT_FALSE(restore_database(folder_, "absent.db"));
  EXPECT_FALSE(restore_database(folder_, "../selfcal.db"));
  const auto newer = restore_database(folder_, "newer.db");
  ASSERT_FALSE(newer);
  EXPECT_THAT(newer.error().message, HasSubstr("schema version 999 is newer"));
  EXPECT_EQ(runs(database_path(folder_)), 3u);
}

TEST_F(DatabaseCopiesTest, OneAtATime) {
  auto first = StateLock::take(folder_);
  ASSERT_TRUE(first);
  const auto second = StateLock::take(folder_);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("in use by another"));
  first = StateLock::take("/nonexistent");  // an error takes the lock's place and so gives it back
  EXPECT_TRUE(StateLock::take(folder_));
}

}  // namespace
}  // namespace selfcal
