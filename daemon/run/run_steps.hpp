// What the steps of a run have in common. A step is a coroutine that does the dialogue of one action of the table; it answers
// with the event that follows, or with why it could not be done. Those who write steps derive from this.
#pragma once

#include <string>

#include "daemon/host/task.hpp"
#include "daemon/ins/ins_client.hpp"
#include "daemon/run/budget_watch.hpp"
#include "daemon/run/run_data.hpp"
#include "daemon/run/run_journal.hpp"
#include "daemon/run/transition_table.hpp"

namespace selfcal {

using Step = Answer<Event>;

// All of these outlive the steps.
struct StepContext {
  Timers& timers;
  InsPort& port;
  RunStore& store;
  InsClient& client;
  BudgetWatch& budget;
  RunJournal& journal;
  RunData& data;
};

class RunSteps {
 protected:
  explicit RunSteps(const StepContext& context);

  // The INS's state, taken for the time that the rotation takes.
  Task<Answer<ins::StateRecord>> ask_state();
  // Until the INS is in another state, `limit_s` of its clock at the most; else "`what` after 30 s".
  Task<Answer<Done>> await_state(ins::State unwanted, double limit_s, std::string what);
  // Pages, passes: the budget of the state begins anew.
  void progressed();

  tl::unexpected<PortError> protocol_error(const std::string& message) const;  // begins it with the interface
  tl::unexpected<PortError> local_trouble(const Error& error) const;           // disk or database, not the INS
  std::chrono::nanoseconds ins_time(double seconds) const;  // real time in which the INS's clock runs so long
  std::string what_the_ins_holds() const;                   // "the old set is in force"

  Timers& timers_;
  InsPort& port_;
  RunStore& store_;
  InsClient& client_;
  BudgetWatch& budget_;
  RunJournal& journal_;
  RunData& data_;
};

// By how far the run has come on the way to a new set.
std::string what_the_ins_holds(const RunData& data, State main_path);

}  // namespace selfcal
