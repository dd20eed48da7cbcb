// What programs get to read of a run: the sets that went over the bus, the history, its warnings.
#include "daemon/store/run_documents.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "estimator/geometry/units.hpp"
#include "protocol/ins_interface/coefficients.hpp"
#include "tests/unit/daemon/scratch_folder.hpp"

namespace selfcal {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class RunDocumentsTest : public testing::Test {
 protected:
  RunDocumentsTest() { store_ = std::move(*RunStore::open(folder_ / "selfcal.db")); }

  RunRecord completed(const std::string& ended_utc, double bias_x_ug) {
    RunRecord run;
    run.ins = std::string("bench");
    run.id = *store_->create_run(run);
    run.serial = std::string("S1");
    run.state = State::completed;
    run.ended_utc = ended_utc;
    run.exit_status = 0;
    EXPECT_TRUE(store_->update_run(run));
    RunStore::Parameters parameters;
    parameters.value[0] = bias_x_ug;
    parameters.sigma.fill(1.0);
    parameters.determined.fill(true);
    EXPECT_TRUE(store_->store_parameters(run.id, parameters));
    return run;
  }
  void keep_set(RunId run, SetRole role, double bias_x_ug) {
    ins::Coefficients set;
    set.version = 7;
    set.date_s = 1767225600;  // 2026-01-01T00:00:00Z
    set.value[0] = bias_x_ug * units::micro_g;
    const auto bytes = ins::encode(set);
    ASSERT_TRUE(store_->store_set(run, role, {bytes.begin(), bytes.end()}));
  }
  json document(const RunRecord& run) { return json::parse(*run_document(*store_, run)); }
  json history(const Limits& limits) { return json::parse(*history_document(*store_, "S1", limits)); }

  const testing_support::ScratchFolder scratch_;
  const std::filesystem::path& folder_ = scratch_.path();
  std::unique_ptr<RunStore> store_;
};

TEST_F(RunDocumentsTest, TheSetsAreShownInTheUnitsOfTheParameters) {
  const RunRecord run = completed("2026-01-01T00:00:00Z", 12);
  keep_set(run.id, SetRole::previous, 30);
  keep_set(run.id, SetRole::written, 12);
  keep_set(run.id, SetRole::read_back, 12);
  const json sets = document(run).at("coefficients");
  EXPECT_EQ(sets.at("previous").at("version"), 7);
  EXPECT_EQ(sets.at("previous").at("date_utc"), "2026-01-01T00:00:00Z");
  const json& first = sets.at("previous").at("parameters").at(0);
  EXPECT_EQ(first.at("name"), "accel_bias_x");
  EXPECT_EQ(first.at("unit"), "ug");
  EXPECT_NEAR(first.at("value").get<double>(), 30, 1e-12);  // a rounding of 30 ug
  EXPECT_NEAR(sets.at("pushed").at("parameters").at(0).at("value").get<double>(), 12, 1e-12);
  EXPECT_EQ(sets.at("pushed"), sets.at("read_back"));
  EXPECT_EQ(sets.at("in_force"), true);
}

TEST_F(RunDocumentsTest, WhatWasNotSentIsNotCalledPushed) {
  RunRecord run = completed("2026-01-01T00:00:00Z", 12);
  run.state = State::refused;
  keep_set(run.id, SetRole::written, 12);
  const json sets = document(run).at("coefficients");
  EXPECT_FALSE(sets.at("proposed").is_null());
  EXPECT_TRUE(sets.at("pushed").is_null());
  EXPECT_TRUE(sets.at("previous").is_null());
  EXPECT_EQ(sets.at("in_force"), false);
}

// Nothing is said of a year after 72 s.
TEST_F(RunDocumentsTest, ValuesOfAFewSecondsHaveNoChangePerYear) {
  completed("2026-01-01T00:00:00Z", 10);
  completed("2026-01-01T00:00:36Z", 11);
  completed("2026-01-01T00:01:12Z", 10);
  const json first = history({}).at("parameters").at(0);
  EXPECT_EQ(first.at("values").size(), 3U);
  EXPECT_FALSE(first.contains("change_per_year")) << first;
  EXPECT_FALSE(first.contains("change_per_year_sigma")) << first;
}

TEST_F(RunDocumentsTest, HistoryWarnsOfADepartureAndOfALimitAhead) {
  completed("2023-01-01T00:00:00Z", 10);
  completed("2024-01-01T00:00:00Z", 20);
  completed("2025-01-01T00:00:00Z", 30);
  EXPECT_TRUE(history({}).at("parameters").at(0).at("warnings").empty());

  EXPECT_NEAR(history({}).at("parameters").at(0).at("change_per_year").get<double>(), 10.0, 0.01);

  // 10 ug a year from 30 ug: 100 ug in seven years.
  Limits limits;
  limits[0] = 100.0;
  const json ahead = history(limits).at("parameters").at(0);
  ASSERT_EQ(ahead.at("warnings").size(), 1u);
  EXPECT_THAT(ahead.at("warnings").at(0).get<std::string>(), HasSubstr("reaches its limit of 100 in 7.0 years"));
  EXPECT_EQ(ahead.at("limit"), 100.0);

  // 40 expected with a sigma of a few ug; 70 is far outside.
  completed("2026-01-01T00:00:00Z", 70);
  const json departed = history({}).at("parameters").at(0);
  ASSERT_EQ(departed.at("warnings").size(), 1u);
  EXPECT_THAT(departed.at("warnings").at(0).get<std::string>(), HasSubstr("70 ug departs from this unit's past"));
  EXPECT_TRUE(history({}).at("parameters").at(1).at("warnings").empty());
}

}  // namespace
}  // namespace selfcal
