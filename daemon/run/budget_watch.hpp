// Watches that a run makes progress: how far it has come, when it last went on, and whether its state's budget
// (state_budget.hpp) is spent.
#pragma once

#include <functional>
#include <optional>

#include "daemon/host/timers.hpp"
#include "daemon/run/state_budget.hpp"

namespace selfcal {

class BudgetWatch {
 public:
  // `spent(seconds)` comes from the loop, so long after the last progress.
  BudgetWatch(Timers& timers, const InsConfig& config, std::function<void(double)> spent)
      : timers_(timers), config_(config), spent_(std::move(spent)) {}
  ~BudgetWatch() { timers_.cancel(timer_); }
  BudgetWatch(const BudgetWatch&) = delete;
  BudgetWatch& operator=(const BudgetWatch&) = delete;

  void begin(State state);  // a new run, or one taken up again
  // True: the run had not come to this state before, so that its budget begins. Otherwise it gets what is left: no cycle of
  // the table goes on for ever.
  bool enter(State state);
  void progressed();
  void learn_page(double seconds_of_data);
  void extend(std::chrono::nanoseconds time);  // for something that is waited for in this state, and is not its rule
  // The farthest state of the way to a new set; the ways to an end (ending_check, stopping) do not count.
  State main_path() const { return main_path_; }

 private:
  void watch();
  void come_to(State state);

  Timers& timers_;
  const InsConfig& config_;
  std::function<void(double)> spent_;
  Timers::Id timer_ = 0;
  State state_ = State::connecting;  // that the run is in, or the farthest that it has come to
  State main_path_ = State::connecting;
  double page_s_ = 0.0;
  SteadyTime progressed_at_{};
  SteadyTime extension_{};
};

}  // namespace selfcal
