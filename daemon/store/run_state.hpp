// The states of a run, as the database keeps them. What leads from one to the next stands in run/transition_table.hpp.
#pragma once

#include <optional>
#include <string_view>

namespace selfcal {

// In the order in which a run comes to them; from completed on it has ended.
enum class State {
  connecting,    // find the INS and read who it is
  unlocking,     // session and SecurityAccess
  scheduling,    // write the rotation schedule
  starting,      // command the rotation
  rotating,      // follow it, pull pages meanwhile
  ending_early,  // every tolerance is met: gimbal to rest, data stay
  draining,      // gimbal at rest, last pages
  estimating,    // estimator at work, off the loop
  judging,       // may this be written?
  checking_old,  // free-inertial drift with the old set
  erasing,       // inactive slot
  writing,       // new set into the inactive slot
  verifying,     // read it back
  committing,    // make it the newest valid slot
  resetting,     // power cycle
  confirming,    // read what is in force
  checking_new,  // free-inertial drift with the new set
  ending_check,  // navigation check to be ended on the INS before the run ends
  stopping,      // gimbal to be stopped before the run ends
  putting_back,  // an INS without slots: its old set to be written again before the run ends
  completed,     // end: done (also a dry run)
  refused,       // end: the answer is no, nothing was written
  failed,        // end: trouble
  aborted,       // end: by an operator
};

bool is_final(State state);
bool gimbal_may_turn(State state);

std::string_view name(State state);
std::optional<State> state_from_name(std::string_view text);

// What the INS is being asked to do, for people: "rotating, pulling data".
std::string_view words(State state);

}  // namespace selfcal
