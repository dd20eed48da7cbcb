#include "tools/report/run_words.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "tools/report/run_document.hpp"

namespace selfcal::report {
namespace {

using Json = nlohmann::ordered_json;

Json result(bool acceptable, const char* consistency) {
  return {{"parameters", Json::array()},
          {"acceptable", acceptable},
          {"objections", acceptable ? Json::array() : Json{"gyro_scale_y not determined"}},
          {"consistency", {{"verdict", consistency}, {"words", "The data do not fit."}}}};
}

Json run(const char* state, int exit_status, const Json& its_result) {
  return {{"run", 2},
          {"serial", "SN-1"},
          {"state", state},
          {"exit_status", exit_status},
          {"reason", exit_status == 0 ? "" : "beyond the limit"},
          {"events", Json::array()},
          {"result", its_result},
          {"coefficients", {{"in_force", exit_status == 0}}}};
}

std::string standing(const Json& document) { return page_summary(document).at("standing").get<std::string>(); }

TEST(PageSummary, OfAResultWithoutOneFollowsTheGateAndTheConsistency) {
  EXPECT_EQ(standing(result(true, "consistent")), "good");
  EXPECT_EQ(standing(result(false, "consistent")), "bad");
  EXPECT_EQ(standing(result(true, "inconsistent")), "bad");
  EXPECT_EQ(page_summary(result(true, "inconsistent")).at("cause"), "The data do not fit.");
  EXPECT_EQ(page_summary(result(false, "consistent")).at("verdict"), "Not accepted: gyro_scale_y not determined.");
}

TEST(PageSummary, IsTheDocumentsOwn) {
  Json document = result(true, "consistent");
  document["summary"] = {{"standing", "open"}, {"verdict", "Said before."}, {"cause", ""}, {"next", ""}};
  EXPECT_EQ(page_summary(document), document["summary"]);
  document["run"] = run("refused", 1, Json());
  document["run"]["summary"] = {{"standing", "bad"}, {"verdict", "Said by the run."}, {"cause", ""}, {"next", ""}};
  EXPECT_EQ(page_summary(document), document["run"]["summary"]);
}

// A run refused for the operator's limit alone was stored with "acceptable": true.
TEST(PageSummary, OfARefusedRunIsNeverGood) {
  const Json page = run_page_document(run("refused", 1, result(true, "consistent")), std::nullopt);
  EXPECT_EQ(page.at("summary").at("standing"), "bad");
  EXPECT_EQ(page.at("summary").at("verdict"), "Run 2 refused: beyond the limit.");
  Json told = result(true, "consistent");
  told["summary"] = {{"standing", "good"}, {"verdict", "All 24."}, {"cause", ""}, {"next", ""}};
  EXPECT_EQ(run_page_document(run("failed", 4, told), std::nullopt).at("summary").at("standing"), "bad");
  EXPECT_EQ(run_page_document(run("completed", 0, told), std::nullopt).at("summary"), told["summary"]);
}

TEST(PageSummary, OfARunWithoutResultIsItsEnd) {
  EXPECT_EQ(run_page_document(run("failed", 4, Json()), std::nullopt).at("summary").at("standing"), "bad");
  EXPECT_EQ(run_page_document(run("completed", 0, Json()), std::nullopt).at("summary").at("standing"), "good");
  Json under_way = run("rotating", 0, Json());
  under_way["exit_status"] = nullptr;
  EXPECT_EQ(run_page_document(under_way, std::nullopt).at("summary").at("standing"), "open");
}

TEST(ForceOfRun, IsNowOnlyWhereTheDocumentSaysSo) {
  // Documents before `in_force`: the set was confirmed at the end of the run, and a later run may have replaced it.
  const Json old = force_of_run(run("completed", 0, Json()));
  EXPECT_FALSE(old.at("now").get<bool>());
  EXPECT_EQ(old.at("words").get<std::string>().find("is in force"), std::string::npos);

  Json document = run("completed", 0, Json());
  document["in_force"] = {
      {"now", true}, {"known", true}, {"from_utc", "A"}, {"until_utc", nullptr}, {"ended_by_run", nullptr}};
  EXPECT_TRUE(force_of_run(document).at("now").get<bool>());
  EXPECT_EQ(force_of_run(document).at("words"), "The set of this run is in force since A.");

  document["in_force"] = {{"now", false}, {"known", true}, {"from_utc", "A"}, {"until_utc", "B"}, {"ended_by_run", 3}};
  EXPECT_FALSE(force_of_run(document).at("now").get<bool>());
  EXPECT_EQ(force_of_run(document).at("words"), "The set of this run was in force from A until B; run 3 replaced it.");

  document["in_force"]["known"] = false;
  EXPECT_EQ(force_of_run(document).at("words"),
            "The set of this run was in force from A; run 3 broke off B and may have replaced it.");

  document["in_force"] = {
      {"now", false}, {"known", true}, {"from_utc", nullptr}, {"until_utc", nullptr}, {"ended_by_run", nullptr}};
  EXPECT_EQ(force_of_run(document).at("words"), "The set of this run was never in force.");
}

// The curves of a page are computed again from the recording: a file that was changed since says so.
TEST(RunPage, NamesARecordingThatIsNotTheRuns) {
  Json told = result(true, "consistent");
  told["input"] = {{"name", "a.h5"}, {"sha256", "11"}};
  Json again = told;
  const Json completed = run("completed", 0, told);
  EXPECT_FALSE(run_page_document(completed, again).contains("warnings"));
  again["input"]["sha256"] = "22";
  const Json page = run_page_document(completed, again);
  ASSERT_EQ(page.at("warnings").size(), 1U);
  EXPECT_EQ(page.at("warnings")[0], "the recording is not the one of the run: SHA-256 11 then, 22 now");
}

// The maps of the diagnosis are the recomputation's; the daemon keeps only its words.
TEST(RunPage, KeepsTheMapsOfTheDiagnosis) {
  Json told = result(false, "inconsistent");
  told["diagnosis"] = {{"verdict", "named"}};
  Json again = told;
  again["diagnosis"]["map"] = {{"cells", 1}};
  EXPECT_TRUE(run_page_document(run("refused", 1, told), again).at("diagnosis").contains("map"));
  EXPECT_EQ(run_page_document(run("refused", 1, told), std::nullopt).at("diagnosis"), told["diagnosis"]);
}

}  // namespace
}  // namespace selfcal::report
