// Who answers, in which state, with which set in force; and the way back to it after the link was lost.
#pragma once

#include <string>

#include "daemon/run/navigation_steps.hpp"
#include "daemon/run/run_steps.hpp"

namespace selfcal {

class ConnectionSteps : public RunSteps {
 public:
  ConnectionSteps(const StepContext& context, NavigationSteps& navigation)
      : RunSteps(context), navigation_(navigation) {}

  Task<Step> identify();
  Task<Step> unlock();
  Task<Step> recover_link(SteadyTime lost_at);

  Task<Answer<Done>> check_serial();
  // The INS's state and the set in force.
  Task<Answer<Done>> take_stock();
  // The same INS, before it is changed. One that restarted meanwhile is a lost link: it must be unlocked again.
  Task<Answer<Done>> confirm_identity(std::string before);

 private:
  Task<Answer<Done>> check_power_cycles(ins::StateRecord found, std::string when);
  Task<Answer<Done>> look_for_data();

  NavigationSteps& navigation_;
};

}  // namespace selfcal
