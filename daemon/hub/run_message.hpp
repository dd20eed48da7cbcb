// A run as a set submits it to its hub: one JSON document (schema selfcal.hub_run).
#pragma once

#include <optional>
#include <string>

#include "daemon/hub/outbox.hpp"
#include "daemon/hub/recording_folder.hpp"
#include "daemon/store/run_store.hpp"

namespace selfcal::hub {

// `type`: of the INS, the profile by which the set speaks to it. `recording`: nothing where none was kept.
Expected<std::string> run_message(const RunStore& store, const Outbox& outbox, const RunRecord& run,
                                  const std::string& type, const std::optional<KeptRecording>& recording);

}  // namespace selfcal::hub
