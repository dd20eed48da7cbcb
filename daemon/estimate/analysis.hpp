// What stands behind a recording that the model of 24 errors does not fit. Built with SELFCAL_ANALYSIS (analysis.cpp); a
// program without it (tools/demo builds its service so, and saves a third of the compiling) has analysis_absent.cpp: it
// leaves every cause open.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal {

struct Cause {
  std::optional<diagnosis::Diagnosis> diagnosis;
  std::string failure;                         // where there is no diagnosis: why it cannot be made
  std::optional<discovery::Discovery> beyond;  // where the catalogue explains nothing
};

// Of a recording: some seconds, and up to a minute where the catalogue explains nothing. `step` is told what is done.
Cause cause_of(const ImuData& data, const diagnosis::DiagnosisOptions& options,
               const std::function<void(const std::string& step)>& step = {});

// An effect of the catalogue in words; empty where `id` is none.
std::string words_in_catalogue(std::string_view id);

}  // namespace selfcal
