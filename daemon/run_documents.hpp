// The JSON documents that the operator interface hands out (protocol/operator_api/README.md).
#pragma once

#include <string>

#include "daemon/run_store.hpp"

namespace selfcal {

Expected<std::string> run_document(const RunStore& store, const RunRecord& run);
Expected<std::string> history_document(const RunStore& store, const std::string& serial);

}  // namespace selfcal
