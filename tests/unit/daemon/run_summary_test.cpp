// Whether a run's set is in force now, and what is said of the run.
#include "daemon/store/run_summary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/store/run_documents.hpp"
#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

using Bytes = std::vector<std::uint8_t>;

class RunSummaryTest : public testing::Test {
 protected:
  RunSummaryTest() { store_ = std::move(*RunStore::open(scratch_.path() / "selfcal.db")); }

  RunRecord run(State state, const std::string& ended_utc, const std::string& serial = "S1") {
    RunRecord run;
    run.ins = "bench";
    run.started_utc = ended_utc;
    run.id = *store_->create_run(run);
    run.serial = serial;
    run.state = state;
    run.ended_utc = ended_utc;
    run.exit_status = state == State::completed ? 0 : 4;
    EXPECT_TRUE(store_->update_run(run));
    return run;
  }
  void keep(const RunRecord& run, SetRole role, const Bytes& bytes) {
    EXPECT_TRUE(store_->store_set(run.id, role, bytes));
  }
  json document(const RunRecord& run) { return json::parse(*run_document(*store_, run)); }

  const testing_support::ScratchFolder scratch_;
  std::unique_ptr<RunStore> store_;
};

TEST_F(RunSummaryTest, ARollbackEndsTheForceOfTheSetBefore) {
  run(State::completed, "2026-01-01T00:00:00Z");
  const RunRecord second = run(State::completed, "2026-02-01T00:00:00Z");
  EXPECT_EQ(document(second).at("in_force").at("now"), true);
  RunRecord third;
  third.ins = "bench";
  third.rollback = true;
  third.force_reason = "drifts more";
  third.id = *store_->create_run(third);
  third.serial = "S1";
  third.state = State::completed;
  third.ended_utc = "2026-03-01T00:00:00Z";
  third.exit_status = 0;
  ASSERT_TRUE(store_->update_run(third));

  const json told = document(second);
  EXPECT_EQ(told.at("in_force"), (json{{"now", false},
                                       {"known", true},
                                       {"from_utc", "2026-02-01T00:00:00Z"},
                                       {"until_utc", "2026-03-01T00:00:00Z"},
                                       {"ended_by_run", 3}}));
  EXPECT_EQ(told.at("coefficients").at("in_force"), false);
  EXPECT_NE(told.at("summary").at("standing"), "good");
  EXPECT_THAT(told.at("summary").at("verdict").get<std::string>(), HasSubstr("until run 3"));

  const json rollback = document(third);
  EXPECT_EQ(rollback.at("rolls_back"), 2);
  EXPECT_EQ(rollback.at("schedule"), "");
  EXPECT_EQ(rollback.at("in_force").at("now"), true);
  EXPECT_THAT(rollback.at("summary").at("cause").get<std::string>(), HasSubstr("Run 2 was rolled back: drifts more"));
}

TEST_F(RunSummaryTest, ALaterCalibrationOfTheSameUnitEndsItAndNoOther) {
  const RunRecord first = run(State::completed, "2026-01-01T00:00:00Z");
  run(State::completed, "2026-02-01T00:00:00Z", "another unit");
  run(State::refused, "2026-02-02T00:00:00Z");
  EXPECT_TRUE(in_force(*store_, first)->now);
  run(State::completed, "2026-03-01T00:00:00Z");
  const InForce answer = *in_force(*store_, first);
  EXPECT_FALSE(answer.now);
  EXPECT_EQ(answer.until_utc, "2026-03-01T00:00:00Z");
  EXPECT_EQ(answer.ended_by_run, 4);
}

// A run that broke off after its set was in the INS may have made it the newest; what the next run finds decides.
TEST_F(RunSummaryTest, WhatABrokenRunLeftIsNotKnownUntilTheNextOneLooks) {
  const Bytes ours{1}, theirs{2};
  const RunRecord first = run(State::completed, "2026-01-01T00:00:00Z");
  keep(first, SetRole::written, ours);
  const RunRecord broken = run(State::failed, "2026-02-01T00:00:00Z");
  keep(broken, SetRole::previous, ours);
  keep(broken, SetRole::read_back, theirs);
  InForce answer = *in_force(*store_, first);
  EXPECT_FALSE(answer.now);
  EXPECT_FALSE(answer.known);
  EXPECT_EQ(answer.ended_by_run, broken.id);

  const RunRecord looks = run(State::aborted, "2026-03-01T00:00:00Z");
  keep(looks, SetRole::previous, ours);
  answer = *in_force(*store_, first);
  EXPECT_TRUE(answer.now);
  EXPECT_TRUE(answer.known);

  const RunRecord again = run(State::aborted, "2026-04-01T00:00:00Z");
  keep(again, SetRole::previous, theirs);  // written by somebody else
  answer = *in_force(*store_, first);
  EXPECT_FALSE(answer.now);
  EXPECT_TRUE(answer.known);
  EXPECT_EQ(answer.ended_by_run, again.id);
}

TEST_F(RunSummaryTest, WhatTheGateRefusedIsNeverToldAsGood) {
  RunRecord forced = run(State::completed, "2026-01-01T00:00:00Z");
  forced.force_reason = "trial";
  forced.result_json = R"({"summary":{"standing":"bad","verdict":"Recording and model disagree.","cause":"NIS 9.",
                           "next":"selfcal diagnose r.h5"},"diagnosis":{"verdict":"named"}})";
  ASSERT_TRUE(store_->update_run(forced));
  const json told = document(forced).at("summary");
  EXPECT_EQ(told.at("standing"), "bad");
  EXPECT_THAT(told.at("verdict").get<std::string>(), HasSubstr("in force"));
  EXPECT_THAT(told.at("cause").get<std::string>(), HasSubstr("Recording and model disagree."));
  EXPECT_EQ(told.at("next"), "selfcal amend 1");

  RunRecord refused = forced;
  refused.state = State::refused;
  refused.force_reason.clear();
  ASSERT_TRUE(store_->update_run(refused));
  EXPECT_EQ(document(refused).at("summary").at("verdict"), "Not written: Recording and model disagree.");
}

}  // namespace
}  // namespace selfcal
