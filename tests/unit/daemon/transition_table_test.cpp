#include "daemon/run/transition_table.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

namespace selfcal {
namespace {

constexpr int state_count = static_cast<int>(State::aborted) + 1;

bool has_row(State state, Event event) {
  return find_transition(state, event, [](Guard guard) { return guard == Guard::always; }) != nullptr;
}

TEST(TransitionTable, EveryStateThatRunsCanEndAndCanGoOnAfterARestart) {
  for (int i = 0; i < state_count; ++i) {
    const State state = static_cast<State>(i);
    if (is_final(state)) {
      continue;
    }
    EXPECT_TRUE(has_row(state, Event::step_failed)) << name(state);
    EXPECT_TRUE(has_row(state, Event::abort_requested)) << name(state);
    EXPECT_TRUE(has_row(state, Event::recovered)) << name(state);
    // Estimating and judging need no INS.
    const bool off_bus = state == State::estimating || state == State::judging;
    EXPECT_EQ(has_row(state, Event::link_lost), !off_bus) << name(state);
    EXPECT_EQ(has_row(state, Event::link_gone), !off_bus) << name(state);
  }
}

TEST(TransitionTable, NothingLeavesAFinalState) {
  for (const Transition& row : transition_table()) {
    EXPECT_FALSE(is_final(row.state)) << name(row.state);
  }
}

TEST(TransitionTable, AFinalStateIsEnteredByConcludingAndOnlyThen) {
  for (const Transition& row : transition_table()) {
    EXPECT_EQ(is_final(row.next), row.action == Action::conclude) << name(row.state) << " " << name(row.event);
  }
}

// Where the gimbal may turn, every way to a failure or abort leads through stopping it; only a link that is gone
// for good, and a stop that cannot be done, end without.
TEST(TransitionTable, TheGimbalIsStoppedBeforeARunEnds) {
  for (const Transition& row : transition_table()) {
    if (!gimbal_may_turn(row.state) || row.state == State::stopping || !is_final(row.next)) {
      continue;
    }
    EXPECT_EQ(row.event, Event::link_gone) << name(row.state) << " " << name(row.event);
  }
}

// Likewise for a navigation check, which the INS would go on with for minutes, and refuse the next run meanwhile.
TEST(TransitionTable, ANavigationCheckIsEndedBeforeARunEnds) {
  for (const Transition& row : transition_table()) {
    if (row.state != State::checking_old && row.state != State::checking_new) {
      continue;
    }
    const bool over = row.event == Event::drift_measured;
    EXPECT_EQ(is_final(row.next) && !over, row.event == Event::link_gone) << name(row.state) << " " << name(row.event);
  }
}

// What was written may stand over the old set: every way to a failure or abort leads through putting it back; only a link
// that is gone for good, and a putting back that cannot be done, end without.
TEST(TransitionTable, WithoutSlotsTheOldSetIsPutBackBeforeARunEnds) {
  const auto no_slots = [](Guard guard) { return guard == Guard::always || guard == Guard::no_slots; };
  for (const State state : {State::writing, State::verifying, State::committing, State::resetting, State::confirming}) {
    for (const Event event : {Event::step_failed, Event::abort_requested, Event::recovered}) {
      const Transition* row = find_transition(state, event, no_slots);
      ASSERT_NE(row, nullptr) << name(state) << " " << name(event);
      EXPECT_FALSE(is_final(row->next)) << name(state) << " " << name(event);
      EXPECT_TRUE(event != Event::step_failed || row->action == Action::put_back) << name(state);
    }
  }
  // Half of a set that was being written is never built upon.
  EXPECT_EQ(find_transition(State::writing, Event::recovered, no_slots)->action, Action::put_back);
}

// Rotation is commanded from one place only, and never upon recovery.
TEST(TransitionTable, NoSecondRotationOnTopOfAFirst) {
  int starts = 0;
  for (const Transition& row : transition_table()) {
    if (row.action != Action::start_rotation) {
      continue;
    }
    ++starts;
    EXPECT_EQ(row.state, State::scheduling);
    EXPECT_EQ(row.event, Event::schedule_accepted);
  }
  EXPECT_EQ(starts, 1);
}

TEST(TransitionTable, ACommitIsReachedThroughReadingBackOnly) {
  for (const Transition& row : transition_table()) {
    if (row.action == Action::commit) {
      EXPECT_EQ(row.event, Event::set_verified);
    }
  }
}

TEST(TransitionTable, EveryStateIsReachable) {
  std::set<State> reached{State::connecting};
  for (int i = 0; i < state_count; ++i) {
    for (const Transition& row : transition_table()) {
      if (reached.contains(row.state)) {
        reached.insert(row.next);
      }
    }
  }
  EXPECT_EQ(static_cast<int>(reached.size()), state_count);
}

TEST(TransitionTable, NamesGoThereAndBack) {
  for (int i = 0; i < state_count; ++i) {
    const State state = static_cast<State>(i);
    EXPECT_EQ(state_from_name(name(state)), state);
  }
  EXPECT_FALSE(state_from_name("dreaming"));
}

TEST(TransitionTable, ReadmeShowsThisTable) {
  std::ifstream in(SELFCAL_SOURCE_DIR "/daemon/README.md");
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_NE(text.str().find(transition_table_markdown()), std::string::npos)
      << "daemon/README.md must hold this table:\n"
      << transition_table_markdown();
}

}  // namespace
}  // namespace selfcal
