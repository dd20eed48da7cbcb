// What a run works with: its configuration, and what it has learnt of its INS and computed for it. Nothing here acts.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/host/config.hpp"
#include "daemon/host/timers.hpp"
#include "daemon/ins/ins_port.hpp"
#include "daemon/ins/unlock_key.hpp"
#include "daemon/run/rotation_clock.hpp"
#include "daemon/store/page_recording.hpp"
#include "estimator/geometry/schedule.hpp"
#include "protocol/ins_interface/records.hpp"

namespace selfcal {

struct RunData {
  RunData(InsConfig ins_config, Schedule positions, UnlockKey unlock_key, std::filesystem::path run_folder)
      : config(std::move(ins_config)), schedule(std::move(positions)), key(unlock_key), folder(std::move(run_folder)) {}

  const InsConfig config;
  const Schedule schedule;
  const UnlockKey key;
  const std::filesystem::path folder;  // its own

  // As the INS answered last.
  ins::StateRecord state;
  ins::SampleFormatRecord format;
  std::optional<std::uint32_t> power_cycles;
  int restarts_taken_up = 0;   // that no request noticed, see ConnectionSteps::confirm_identity
  Bytes in_force;              // coefficient records, as on the bus
  bool data_complete = false;  // the FLASH holds all of the last rotation, whatever the INS has done since
  RotationClock rotation_clock;
  SteadyTime status_at{};  // the last status frame

  // Computed for it.
  std::optional<Estimate> estimate;
  std::vector<std::string> objections;  // of the gate
  Bytes new_set;
  bool commit_asked = false;
  bool old_set_put_back = false;

  bool new_set_in_force() const { return !new_set.empty() && in_force == new_set; }
};

}  // namespace selfcal
