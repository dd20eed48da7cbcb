// The JSON documents that the operator interface hands out (protocol/operator_api/README.md).
#pragma once

#include <string>

#include "daemon/estimate/gate.hpp"
#include "daemon/store/run_store.hpp"

namespace selfcal {

Expected<std::string> run_document(const RunStore& store, const RunRecord& run);
// `serial` empty: the runs of all, no parameters. The warnings are about the latest value of each parameter.
Expected<std::string> history_document(const RunStore& store, const std::string& serial, const Limits& limits);

}  // namespace selfcal
