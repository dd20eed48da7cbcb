// From the erased slot to the proof that the INS uses the new set.
#pragma once

#include "daemon/run/connection_steps.hpp"
#include "daemon/run/run_steps.hpp"

namespace selfcal {

class CoefficientSteps : public RunSteps {
 public:
  CoefficientSteps(const StepContext& context, ConnectionSteps& connection)
      : RunSteps(context), connection_(connection) {}

  Task<Step> erase_inactive_slot();
  Task<Step> write_set();
  Task<Step> read_back();
  Task<Step> commit();
  Task<Step> reset_ins();
  Task<Step> read_in_force();
  // Of an INS without slots: the set that was in force before the run, written again, read back and in force after a restart.
  Task<Step> put_back();

 private:
  Task<Answer<Done>> check_erased();

  ConnectionSteps& connection_;
};

}  // namespace selfcal
