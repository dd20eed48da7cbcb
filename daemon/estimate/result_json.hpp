// The answer as a JSON document (`selfcal estimate --json`; the daemon keeps the same text). Its schema:
// protocol/document/schemas/estimate.schema.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/estimate/judged_result.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/recording/recording.hpp"

namespace selfcal {

// Names and units of the 24 are those of sensor_parameters. `warnings` are the reader's. With `curves` the passes
// carry their convergence (epochs, values, sigmas) and the document its correlation matrix, for the report. `input` is
// the recording's file. The gate's answer, the summary and, where there is one, the diagnosis are those of `judged`.
nlohmann::ordered_json result_json(const JudgedResult& judged, const CalibrationOptions& options,
                                   const Recording& recording, const std::vector<std::string>& warnings,
                                   bool curves = false, const document::InputFile& input = {});

// As one line of text, for those who keep it rather than look into it. Not finite numbers become null.
std::string result_json_text(const JudgedResult& judged, const CalibrationOptions& options, const Recording& recording,
                             const std::vector<std::string>& warnings, bool curves = false,
                             const document::InputFile& input = {});

}  // namespace selfcal
