// A kept recording taken up again with the physics that the diagnosis names in it: what the estimator's thread does in
// an amendment (`selfcal amend RUN`).
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "daemon/estimate/estimate_worker.hpp"
#include "daemon/estimate/unit_answer.hpp"
#include "daemon/store/run_store.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/discovery/discovery.hpp"

namespace selfcal {

// A run's recording.
struct KeptRecording {
  RunId run = 0;
  std::filesystem::path file;
};

struct AmendmentRequest {
  KeptRecording amends;
  std::vector<KeptRecording> with;  // of further runs of the same INS: the search for laws looks at all of them
  std::filesystem::path folder;     // of this run; gets a recording of its own (a link, where the disk can)
  InsConfig config;
};

// What the search for laws says, in one recording or in several of the unit.
struct BeyondAnswer {
  discovery::Discovery found;
  std::optional<Together> together;          // several
  std::optional<discovery::JointFit> joint;  // of them
  std::optional<discovery::NextExperiment> next;
};

// The answer holds the 24 as fitted together with what was named, with their sigma; it is consistent where what
// remains passes the diagnosis's tests. Where the catalogue leaves something, in this recording or in one of `with`, laws are
// searched for; those that hold in two recordings and more and leave noise (`confirmed`) are fitted too, and sigma holds what the 24
// differ by between all laws that are left open. Its document is that of `selfcal estimate --json` with "amends" (the run),
// "diagnosis" (as `selfcal diagnose --json`), "together" and "next_experiment".
EstimateJob amendment_job(AmendmentRequest request);

// The same without files: what an amendment may not be written for comes first among the objections. `next`: the experiment where laws may
// stand in the place of what is named (doubtful()).
Estimate amended_estimate(const diagnosis::Diagnosis& diagnosis, const AmendmentRequest& request,
                          const Recording& recording, std::optional<BeyondAnswer> beyond = std::nullopt,
                          const std::optional<discovery::NextExperiment>& next = std::nullopt);

}  // namespace selfcal
