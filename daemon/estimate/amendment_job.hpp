// A kept recording taken up again with the physics that the diagnosis names in it: what the estimator's thread does in
// an amendment (`selfcal amend RUN`).
#pragma once

#include <filesystem>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/store/run_store.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal {

struct AmendmentRequest {
  RunId amends = 0;                 // the run whose recording it is
  std::filesystem::path recording;  // of that run
  std::filesystem::path folder;     // of this run; gets a recording of its own (a link, where the disk can)
  InsConfig config;
};

// The answer holds the 24 as fitted together with what was named, with their sigma; it is consistent where what
// remains passes the diagnosis's tests. Its document is that of `selfcal estimate --json` with "amends" (the run) and
// "diagnosis" (as `selfcal diagnose --json`).
EstimateJob amendment_job(AmendmentRequest request);

// The same without files: what an amendment may not be written for comes first among the objections.
// `beyond`: what was found where the catalogue explains nothing.
Estimate amended_estimate(const diagnosis::Diagnosis& diagnosis, const AmendmentRequest& request,
                          const Recording& recording, std::optional<discovery::Discovery> beyond = std::nullopt);

}  // namespace selfcal
