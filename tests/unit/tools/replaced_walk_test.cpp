// A walk that the catalogue names, and jumps at the turns that the search finds in its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "daemon/estimate/beyond_catalogue.hpp"

namespace selfcal {
namespace {

using discovery::Discovery;
using discovery::ProcessKind;

diagnosis::Diagnosis named(const std::vector<std::string>& effects) {
  diagnosis::Diagnosis d;
  d.verdict = diagnosis::DiagnosisVerdict::named;
  for (const std::string& effect : effects) {
    diagnosis::Finding f;
    f.effect = effect;
    f.process = true;
    d.findings.push_back(f);
  }
  return d;
}

// Processes that leave noise.
Discovery found(std::vector<discovery::DiscoveredProcess> processes) {
  Discovery d;
  d.misfit_before = 500.0;
  d.misfit_after = 5.0;
  d.processes = std::move(processes);
  return d;
}

TEST(ReplacedWalk, JumpsThatAreFarLikelierTakeItsPlace) {
  diagnosis::Diagnosis d = named({"gyro_random_walk"});
  replace_process(d, found({{ProcessKind::jump_per_turn, 1, 0.05, 0.01, 80.0, 6.0}}));
  EXPECT_TRUE(d.findings.empty());
  ASSERT_EQ(d.rejected.size(), 1U);
  EXPECT_EQ(d.rejected[0].effect, "gyro_random_walk");
  EXPECT_TRUE(d.unexplained);
  EXPECT_EQ(d.verdict, diagnosis::DiagnosisVerdict::none_of_the_above);
}

TEST(ReplacedWalk, StaysWhereItIsAsLikelyOrAnotherProcess) {
  const discovery::DiscoveredProcess jump{ProcessKind::jump_per_turn, 1, 0.05, 0.01, 80.0, 6.0};
  const discovery::DiscoveredProcess doubtful{ProcessKind::jump_per_turn, 1, 0.05, 0.01, 80.0, 2.0};  // e^2 to 1
  const discovery::DiscoveredProcess walk{ProcessKind::random_walk, 1, 0.05, 0.01, 80.0, 6.0};
  const discovery::DiscoveredProcess elsewhere{ProcessKind::jump_per_turn, 4, 5.0, 1.0, 80.0, 6.0};
  for (const auto& [names, processes] : {std::pair{std::vector<std::string>{"gyro_random_walk"}, std::vector{doubtful}},
                                         {{"gyro_random_walk"}, {walk}},
                                         {{"gyro_random_walk"}, {elsewhere}},
                                         {{"gyro_random_walk"}, {jump, elsewhere}},
                                         {{"gyro_random_walk", "accel_random_walk"}, {jump}},
                                         {{"gyro_bias_instability"}, {jump}}}) {
    diagnosis::Diagnosis d = named(names);
    replace_process(d, found(processes));
    EXPECT_EQ(d.findings.size(), names.size()) << names.front();
    EXPECT_FALSE(d.unexplained);
  }
}

}  // namespace
}  // namespace selfcal
