// What a driver of a batch tells systemd's journal, with fields as the service's entries have them: SELFCAL_BATCH (as in
// `selfcal metrics`), SELFCAL_STATE (begun, failed, done, paused, open) and, of a task, SELFCAL_STEP, SELFCAL_TASK, SELFCAL_KEY.
// Nothing where there is no journal: people have the driver's own output.
#pragma once

#include "tools/batch/batch_folder.hpp"

namespace selfcal::batch {

class BatchJournal {
 public:
  explicit BatchJournal(const BatchFolder& folder);
  void begun() const;
  void task_ended(std::size_t task) const;  // told where it failed
  void ended() const;
  void broken_off(const Error& error) const;

 private:
  const BatchFolder& folder_;
  std::string batch_;
};

}  // namespace selfcal::batch
