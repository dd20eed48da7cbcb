// Which recordings go, and what a run needs before it starts.
#include "daemon/store/recording_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class RecordingStoreTest : public testing::Test {
 protected:
  RecordingStoreTest() { store_ = std::move(*RunStore::open(folder_ / "selfcal.db")); }

  RunId recorded(double mib, std::chrono::hours age, State state = State::completed) {
    RunRecord run;
    run.id = *store_->create_run(run);
    run.state = state;
    run.recording = (folder_ / (std::to_string(run.id) + ".h5")).string();
    std::ofstream(run.recording).put('x');
    fs::resize_file(run.recording, static_cast<std::uintmax_t>(mib * 1048576));  // sparse: no room is taken
    fs::last_write_time(run.recording, now_ - age);
    EXPECT_TRUE(store_->update_run(run));
    return run.id;
  }
  std::vector<RunId> prune(double quota_mib, double keep_days) {
    const auto pruned = prune_recordings(*store_, {quota_mib, keep_days}, now_);
    EXPECT_TRUE(pruned);
    std::vector<RunId> ids;
    for (const PrunedRecording& gone : *pruned) {
      ids.push_back(gone.run.id);
      EXPECT_FALSE(fs::exists(gone.run.recording));
      EXPECT_EQ(store_->run(gone.run.id).value()->recording, "");
    }
    return ids;
  }

  const testing_support::ScratchFolder scratch_;
  const fs::path& folder_ = scratch_.path();
  std::unique_ptr<RunStore> store_;
  fs::file_time_type now_ = fs::file_time_type::clock::now();
};

TEST_F(RecordingStoreTest, TheOldestGoUntilTheQuotaIsKept) {
  for (int i = 0; i < 4; ++i) {
    recorded(10, 1h);
  }
  EXPECT_THAT(prune(40, 0), IsEmpty());
  EXPECT_THAT(prune(25, 0), ElementsAre(1, 2));  // 40 to 20
  EXPECT_THAT(prune(25, 0), IsEmpty());
}

TEST_F(RecordingStoreTest, WhatIsTooOldGoes) {
  recorded(1, 24h * 10);
  recorded(1, 24h * 31);
  recorded(1, 24h * 29);
  EXPECT_THAT(prune(1000, 0), IsEmpty());
  EXPECT_THAT(prune(1000, 30), ElementsAre(2));
}

TEST_F(RecordingStoreTest, ARunInProgressKeepsItsOwn) {
  recorded(10, 24h * 100, State::checking_old);
  EXPECT_THAT(prune(1, 1), IsEmpty());
}

TEST_F(RecordingStoreTest, ARecordingThatIsGoneAlreadyIsForgottenWhenItsTurnComes) {
  const RunId run = recorded(10, 1h);
  fs::remove(store_->run(run).value()->recording);
  recorded(10, 1h);
  EXPECT_THAT(prune(15, 0), IsEmpty());  // it takes no room
}

TEST_F(RecordingStoreTest, SpaceIsToldWithItsFigures) {
  EXPECT_TRUE(require_space(folder_, 1, "a byte"));
  const auto refused = require_space(folder_, std::uint64_t{1} << 60, "an exbibyte");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::device);
  EXPECT_THAT(refused.error().message, HasSubstr("MiB free, an exbibyte needs 1099511627776 MiB"));
  // 49 min at 200 Hz: 588000 samples of 28 bytes in pages of 145, and 80 bytes each in the recording.
  const double mib = static_cast<double>(bytes_of_a_run(588000)) / 1048576;
  EXPECT_GT(mib, 588000 * 108.0 / 1048576);
  EXPECT_LT(mib, 1.1 * 588000 * 108.0 / 1048576);
}

}  // namespace
}  // namespace selfcal
