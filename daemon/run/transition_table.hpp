// The calibration as one table: in this state, upon this event, if this guard holds: go there and do that.
//
// The engine (calibration_run.hpp) stores the next state in the database before it performs the action, so that
// after a crash the table defines how the run continues: the event `recovered` (bus back, INS restarted, daemon restarted) has a
// row in every state. daemon/README.md shows this table; a test compares the two.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "daemon/store/run_state.hpp"

namespace selfcal {

enum class Event {
  begin,
  identified,
  unlocked,
  schedule_accepted,
  rotation_started,
  tolerances_met,  // and the gimbal stands
  rotation_ended,
  pages_complete,
  estimate_ready,
  judged,
  drift_measured,
  slot_erased,
  set_written,
  set_verified,
  set_committed,
  ins_restarted,
  set_confirmed,
  gimbal_stopped,
  check_ended,
  set_put_back,
  link_lost,    // no answer, or the interface went down
  recovered,    // identified and unlocked again
  link_gone,    // not recovered within the stated time
  step_failed,  // anything else that cannot be mended
  abort_requested,
};

enum class Guard {
  always,
  rollback,           // a former set is to be put back, nothing to be measured
  amendment,          // a kept recording is to be estimated again, nothing to be measured
  gimbal_turning,     // by the INS's answer, and it is this run's rotation
  rotation_complete,  // by the INS's answer, and it is this run's rotation
  gate_refused,       // not determined, inconsistent or implausible, and no operator's reason to write it anyway
  dry_run,
  drift_check_wanted,
  new_set_in_force,  // slot in force holds this run's set
  abort_pending,     // an operator asked for this end
  failure_pending,   // no operator asked for it: a step failed
  no_slots,          // what is written is written over the set in force
};

enum class Action {
  none,
  identify,
  unlock,
  write_schedule,
  start_rotation,
  follow_rotation,
  end_rotation_early,
  pull_last_pages,
  estimate,
  judge,
  measure_drift_old,
  erase_inactive_slot,
  write_set,
  read_back,
  commit,
  reset_ins,
  read_in_force,
  measure_drift_new,
  end_check,
  stop_gimbal,
  put_back,
  recover_link,
  decline_abort,
  conclude,
};

struct Transition {
  State state;
  Event event;
  Guard guard;
  Action action;
  State next;
};

std::span<const Transition> transition_table();

// Which row applies; `holds` evaluates guards. Rows of a state and event are tried in their order.
template <typename Holds>
const Transition* find_transition(State state, Event event, Holds&& holds) {
  for (const Transition& row : transition_table()) {
    if (row.state == state && row.event == event && holds(row.guard)) {
      return &row;
    }
  }
  return nullptr;
}

std::string_view name(Event event);
std::string_view name(Guard guard);
std::string_view name(Action action);
// The table in Markdown, as daemon/README.md holds it.
std::string transition_table_markdown();

}  // namespace selfcal
