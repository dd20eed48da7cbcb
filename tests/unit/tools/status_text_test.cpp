// What the program prints of an INS and of a finding: no line beyond the terminal, nothing lost where it is broken.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/cli/finding_text.hpp"
#include "tools/cli/online_text.hpp"

namespace selfcal::cli {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;

const char* const silent =
    "can0: up, no answer to 0x640: the INS is alive, its status frames 0x650 come; it does not answer 0x640: check "
    "request_id and response_id (0x648), and whether it takes CAN FD: fd = true is configured";

Json idle() {
  return {{"ins", "bench"},
          {"serial", "SIM-0001"},
          {"state", "idle"},
          {"bus", "can0: up, the INS answers"},
          {"in_force", {{"run", 3}, {"kind", "calibration"}, {"from_utc", "2026-11-22T12:00:00Z"}}},
          {"last_calibration", {{"run", 3}, {"state", "completed"}, {"ended_utc", "2026-11-22T12:00:00Z"}}}};
}

std::size_t widest(const std::string& text) {
  std::size_t widest = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    widest = std::max(widest, line.size());
  }
  return widest;
}

TEST(StatusText, AnIdleInsAndItsBus) {
  EXPECT_EQ(status_text(idle().dump(), 80),
            "bench SIM-0001: idle\n"
            "  bus               can0: up, the INS answers\n"
            "  in force          the set of run 3 (calibration), since 2026-11-22T12:00:00Z\n"
            "  last calibration  run 3, completed, 2026-11-22T12:00:00Z\n");
}

TEST(StatusText, NothingWasWrittenYet) {
  Json ins = idle();
  ins["serial"] = "";
  ins["in_force"] = ins["last_calibration"] = Json();
  const std::string text = status_text(ins.dump(), 80);
  EXPECT_THAT(text, HasSubstr("bench: idle\n"));
  EXPECT_THAT(text, HasSubstr("no set that was written from here\n"));
  EXPECT_THAT(text, HasSubstr("last calibration  none\n"));
}

TEST(StatusText, ALongCauseIsBrokenAtTheTerminalsWidth) {
  Json ins = idle();
  ins["bus"] = silent;
  for (const int columns : {60, 80, 200}) {
    const std::string text = status_text(ins.dump(), columns);
    EXPECT_LE(widest(text), static_cast<std::size_t>(columns));
    std::istringstream words(text);
    std::string joined;
    for (std::string word; words >> word;) {
      joined += (joined.empty() ? "" : " ") + word;
    }
    EXPECT_THAT(joined, HasSubstr(silent));
  }
  EXPECT_THAT(status_text(ins.dump(), 0), HasSubstr(std::string(silent) + "\n"));  // no terminal: one line
}

TEST(StatusText, ARunFitsIntoEightyColumns) {
  Json ins = idle();
  ins.erase("in_force");
  ins.erase("last_calibration");
  ins.update(Json{{"state", "rotating"},
                  {"run", 12345},
                  {"user", "operator-on-duty"},
                  {"since", "2026-11-22T12:00:00Z"},
                  {"position", 19},
                  {"positions", 19},
                  {"pages_pulled", 4055},
                  {"pages_expected", 4056},
                  {"finish_in_s", 2940.0},
                  {"estimate", {{"tolerances_met", 23}}}});
  const std::string text = status_text(ins.dump(), 80);
  EXPECT_LE(widest(text), 80U);
  EXPECT_THAT(text, HasSubstr("run               12345 by operator-on-duty since 2026-11-22T12:00:00Z\n"));
  EXPECT_THAT(text, HasSubstr("position 19 of 19, pages 4055 of 4056, ends in 2940 s\n"));
  EXPECT_THAT(text, HasSubstr("23 of 24 parameters to tolerance\n"));
  EXPECT_THAT(text, HasSubstr("bus               can0: up, the INS answers\n"));
}

// Squares of the three components of gravity add up to one: two coefficients of them are known by their difference.
TEST(FindingText, CoefficientsKnownOnlyTogetherAreNotAllZero) {
  diagnosis::Finding finding;
  finding.effect = "accel_cross_coupling";
  finding.significance = 22.1;
  finding.parameters = {{"z_xz", "ug/g^2", 2.3, 2.9}, {"z_xx", "ug/g^2", 10.4, 3.8}, {"z_yy", "ug/g^2", -5.7, 3.8}};
  const std::string together = finding_text(finding);
  EXPECT_THAT(together, HasSubstr("z_xx       10.4 +- 3.8 ug/g^2, the largest; known only together with others\n"));
  EXPECT_THAT(together, HasSubstr("within 3 sigma of zero: z_xz, z_yy\n"));
  finding.parameters[1].sigma = 0.5;
  const std::string alone = finding_text(finding);
  EXPECT_THAT(alone, HasSubstr("z_xx       10.40 +- 0.50 ug/g^2\n"));
  EXPECT_THAT(alone, testing::Not(HasSubstr("together")));
}

}  // namespace
}  // namespace selfcal::cli
