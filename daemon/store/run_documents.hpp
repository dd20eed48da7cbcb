// The JSON documents that the operator interface hands out (protocol/operator_api/README.md).
#pragma once

#include <array>
#include <optional>
#include <string>

#include "daemon/store/run_store.hpp"
#include "estimator/geometry/sensor_parameters.hpp"

namespace selfcal {

// |value| beyond which a parameter is implausible for the type of INS, in the units of sensor_parameters.
using Limits = std::array<std::optional<double>, sensor_parameter_count>;

Expected<std::string> run_document(const RunStore& store, const RunRecord& run);
// `serial` empty: the runs of all, no parameters. The warnings are about the latest value of each parameter.
Expected<std::string> history_document(const RunStore& store, const std::string& serial, const Limits& limits);

}  // namespace selfcal
