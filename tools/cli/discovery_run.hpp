// selfcal diagnose beyond the catalogue: discovery, a user's own laws, the next experiment.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/estimate/beyond_catalogue.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "protocol/document/document_head.hpp"
#include "protocol/error.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/discovery_output.hpp"

namespace selfcal::cli {

struct DiscoveryArguments {
  bool discover = false;          // also where the catalogue leaves nothing
  std::string laws;               // file of laws to try
  std::vector<std::string> with;  // further recordings of the same unit
  std::string next_experiment;    // schedule file to write
};

void add_discovery_options(Options& options, DiscoveryArguments& arguments);

struct BeyondCatalogue {
  std::optional<discovery::Discovery> found;
  std::optional<discovery::JointFit> joint;  // of several recordings, or of effects and laws
  std::optional<Together> together;
  std::optional<discovery::NextExperiment> next;
  std::vector<discovery::TriedLaw> tried;

  // Whether equations or processes were found that take away the misfit.
  bool explains() const { return selfcal::explains(found_or_null()); }
  const discovery::Discovery* found_or_null() const { return found ? &*found : nullptr; }
  // The 24 of the first recording with what was found; with what all recordings share imposed, where there are several.
  ParameterVector parameters() const {
    return joint ? joint->shared.parameters.front() : found->fit.recordings.front().parameters;
  }
  std::string text(Detail detail) const;
  void add_to(nlohmann::ordered_json& document) const;
};

// Looks where the diagnosis of a recording left something unexplained, where it named nothing but a walk or an instability of a bias (and
// then keeps only what replaces that), where there are several, or where asked to; in all of them together. Errors: a file of laws that is wrong (file, law, column), a schedule that cannot be written.
// `first`: the diagnosis of the first recording, to which `recordings` refers; what is found may change it (search_beyond.hpp).
Expected<BeyondCatalogue> look_beyond(const DiscoveryArguments& arguments, std::span<const DiagnosedFile> recordings,
                                      const diagnosis::DiagnosisOptions& of_catalogue, diagnosis::Diagnosis& first);

}  // namespace selfcal::cli
